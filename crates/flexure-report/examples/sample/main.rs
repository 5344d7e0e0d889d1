//! Writes a sample page: `cargo run -p flexure-report --example sample -- OUT.html [full|bare|long]`.
//!
//! `full` has every part, `bare` leaves out all that is optional and shows a model that does not hold, `long` is a
//! record of a million samples.

mod arm;
mod pages;
mod system;

use std::process::ExitCode;

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let (path, kind) = (arguments.next(), arguments.next().unwrap_or_else(|| "full".into()));
    let page = match kind.as_str() {
        "full" => pages::full(),
        "bare" => pages::bare(),
        "long" => pages::long(1_000_000),
        _ => return usage(),
    };
    let Some(path) = path else { return usage() };
    let written = flexure_report::render(&page)
        .map_err(|e| e.to_string())
        .and_then(|html| {
            std::fs::write(&path, &html).map_err(|e| format!("{path}: {e}"))?;
            Ok(html.len())
        });
    match written {
        Ok(bytes) => {
            println!("{path}: {:.2} MB", bytes as f64 / 1e6);
            ExitCode::SUCCESS
        }
        Err(message) => {
            eprintln!("sample: {message}");
            ExitCode::from(1)
        }
    }
}

fn usage() -> ExitCode {
    eprintln!("usage: sample OUT.html [full|bare|long]");
    ExitCode::from(2)
}
