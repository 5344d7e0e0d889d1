//! `flexure app`: the commands in a browser.
//!
//! The server is for this machine only. It listens on 127.0.0.1, answers only under a path that nobody can guess, and only requests of its
//! own page. Every command is this program as a child process, which can be cancelled and takes no other command with it.

mod http;
mod jobs;
mod project;
mod server;

use std::io::IsTerminal;
use std::net::TcpListener;
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Duration;

use anyhow::{Context as _, Result, bail};
use flexure::text::shown_path;
use flexure_io::make_folder;

use crate::arguments;
use crate::output::print;
use crate::signals;
use project::Project;
use server::App;

/// How often the app looks for commands that have ended. Their page may be closed by then.
const ROUND: Duration = Duration::from_millis(500);
/// The largest file that is taken, bytes, unless given.
const LARGEST: u64 = 4 << 30;

/// Work in a browser: drop a record, look, prepare, identify, compare, export.
///
/// The project is a folder with records, models and pages. They have the same formats as on the command line.
/// Everything stays on this machine: only the page at the printed address can use the app. Ctrl-C ends the app.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  flexure app project")]
pub struct Arguments {
    /// The folder of the project. It is created if it does not exist.
    #[arg(default_value = ".")]
    folder: PathBuf,
    /// The port of the address. With 0, the app takes a free port.
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    port: u16,
    /// The largest file that the app takes, for example 8GiB. The default is 4GiB.
    #[arg(long, value_name = "SIZE", value_parser = arguments::memory)]
    largest_file: Option<u64>,
    /// Do not open the page in the browser. By default, it is opened if the output is a terminal.
    #[arg(long)]
    no_open: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    make_folder(&arguments.folder)?;
    let folder = arguments
        .folder
        .canonicalize()
        .with_context(|| shown_path(&arguments.folder))?;
    let listening = TcpListener::bind(("127.0.0.1", arguments.port));
    let listening = listening.and_then(|listener| Ok((listener.local_addr()?, listener)));
    let (address, listener) = match listening {
        Ok(listening) => listening,
        Err(error) => bail!(
            "cannot listen on port {} of 127.0.0.1: {error}; choose another by --port",
            arguments.port
        ),
    };
    let (token, entrance) = (random()?, random()?);
    let page = format!("http://{address}/{token}/");
    let opens = !arguments.no_open && std::io::stdout().is_terminal();
    // The app lives until the process ends.
    let app: &'static App = Box::leak(Box::new(App {
        host: address.to_string(),
        token,
        entrance: Mutex::new(opens.then(|| entrance.clone())),
        project: Project::new(folder, arguments.largest_file.unwrap_or(LARGEST)),
        jobs: jobs::Jobs::default(),
    }));
    signals::before_end(|| app.jobs.end());
    std::thread::spawn(|| {
        loop {
            std::thread::sleep(ROUND);
            app.jobs.look(&app.project);
        }
    });
    print(&format!(
        "{page}\nCtrl-C ends the app. Anyone with this address can use the app."
    ))?;
    if opens {
        // The printed address is for users without a browser on this machine. Other users of the machine can see a program's arguments, so
        // this address works only once.
        let _ = open::that_detached(format!("http://{address}/{entrance}"));
    }
    http::serve(&listener, &|request| app.answer(request));
    Ok(())
}

/// A path that nobody can guess.
fn random() -> Result<String> {
    let mut bytes = [0_u8; 16];
    if let Err(error) = getrandom::fill(&mut bytes) {
        bail!("the system gives no random numbers: {error}");
    }
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}
