//! What is asked for, and the answers.

use std::io::Read;
use std::sync::Arc;

use flexure::identify::structures;
use flexure::nonlinearity::EstimatorName;
use flexure_export::Format;
use flexure_workbench::Named;
use serde_json::{Value, json};
use tiny_http::{Header, Method, Request, Response, Server};

use super::jobs::{self, Jobs};
use super::project::{Project, Refusal};

/// The threads that answer: a page has few requests at once, but an upload holds one.
const THREADS: usize = 8;
/// The longest request but for an upload, bytes.
const LONGEST_REQUEST: u64 = 64 << 10;

/// What the page may do: load its own parts, and show pages of the project in frames.
const OWN: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; frame-src 'self'; \
                   form-action 'none'; base-uri 'none'; frame-ancestors 'none'";
/// What a page of the project may do: show itself. It has no origin, and so nothing of the app.
const FOREIGN: &str = "sandbox allow-scripts allow-downloads; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; \
                       img-src data: blob:; font-src data:; frame-ancestors 'self'";

/// The app: where it is, and what it works on.
pub struct App {
    /// The address that browsers name: `127.0.0.1:PORT`.
    pub host: String,
    pub token: String,
    pub project: Project,
    pub jobs: Jobs,
}

/// An answer.
struct Answer {
    status: u16,
    kind: &'static str,
    policy: &'static str,
    content: Content,
    /// The name under which a browser keeps it.
    download: Option<String>,
}

enum Content {
    Bytes(Vec<u8>),
    File(std::fs::File),
}

impl Answer {
    fn bytes(status: u16, kind: &'static str, content: impl Into<Vec<u8>>) -> Self {
        Answer {
            status,
            kind,
            policy: OWN,
            content: Content::Bytes(content.into()),
            download: None,
        }
    }

    fn json(value: &Value) -> Self {
        Answer::bytes(200, "application/json", value.to_string())
    }

    fn refused(status: u16, problem: impl Into<String>) -> Self {
        Answer::bytes(
            status,
            "application/json",
            json!({ "problem": problem.into() }).to_string(),
        )
    }
}

/// Answers until the process ends.
pub fn serve(server: &Arc<Server>, app: &Arc<App>) {
    std::thread::scope(|scope| {
        for _ in 0..THREADS {
            scope.spawn(|| {
                while let Ok(mut request) = server.recv() {
                    let answer = app.answer(&mut request);
                    // Who asked may have gone.
                    let _ = respond(request, answer);
                }
            });
        }
    });
}

fn respond(request: Request, answer: Answer) -> std::io::Result<()> {
    let disposition = answer.download.map(|name| {
        let encoded: String = name.bytes().map(|byte| format!("%{byte:02X}")).collect();
        format!("attachment; filename*=UTF-8''{encoded}")
    });
    let headers = [
        ("Content-Type", Some(answer.kind.to_owned())),
        ("Content-Security-Policy", Some(answer.policy.to_owned())),
        ("Content-Disposition", disposition),
        ("Cache-Control", Some("no-store".to_owned())),
        ("Referrer-Policy", Some("no-referrer".to_owned())),
        ("X-Content-Type-Options", Some("nosniff".to_owned())),
        ("Cross-Origin-Resource-Policy", Some("same-origin".to_owned())),
    ];
    let headers: Vec<Header> = headers
        .into_iter()
        .filter_map(|(name, value)| Header::from_bytes(name, value?).ok())
        .collect();
    let empty = || Response::empty(answer.status);
    match answer.content {
        Content::File(file) => {
            let response = headers
                .into_iter()
                .fold(Response::from_file(file), |r, h| r.with_header(h));
            request.respond(response)
        }
        Content::Bytes(bytes) if bytes.is_empty() => request.respond(empty()),
        Content::Bytes(bytes) => {
            let response = Response::from_data(bytes).with_status_code(answer.status);
            request.respond(headers.into_iter().fold(response, |r, h| r.with_header(h)))
        }
    }
}

impl App {
    fn answer(&self, request: &mut Request) -> Answer {
        let Some(path) = self.own_path(request) else {
            return Answer::bytes(403, "text/plain", "");
        };
        let (path, query) = path.split_once('?').unwrap_or((&path, ""));
        let parts: Vec<String> = path.split('/').filter_map(decoded).collect();
        let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
        match (request.method(), &parts[..]) {
            (Method::Get, [""]) => Answer::bytes(200, "text/html; charset=utf-8", include_str!("page.html")),
            (Method::Get, ["app.js"]) => Answer::bytes(200, "text/javascript; charset=utf-8", include_str!("page.js")),
            (Method::Get, ["app.css"]) => {
                let style = [flexure_report::STYLE, include_str!("page.css")].concat();
                Answer::bytes(200, "text/css; charset=utf-8", style)
            }
            (Method::Get, ["project"]) => self.project_answer(),
            (Method::Get, ["files", name]) => self.file(name, query == "download"),
            (Method::Put, ["files", name]) => {
                let length = request.body_length().map(|length| length as u64);
                match self.project.keep(name, length, request.as_reader()) {
                    Ok(name) => Answer::json(&json!({ "name": name })),
                    Err(Refusal::Name) => {
                        Answer::refused(400, format!("'{name}' is no name for a file of the project"))
                    }
                    Err(Refusal::Size) => {
                        Answer::refused(413, "the file is too large; --largest-file SIZE allows more")
                    }
                    Err(Refusal::Failed(problem)) => Answer::refused(500, problem),
                }
            }
            (Method::Post, ["jobs"]) => {
                let mut text = Vec::new();
                let read = request.as_reader().take(LONGEST_REQUEST).read_to_end(&mut text);
                let asked = read.map_err(|e| e.to_string());
                let asked =
                    asked.and_then(|_| serde_json::from_slice::<jobs::Request>(&text).map_err(|e| e.to_string()));
                match asked.and_then(|asked| self.jobs.begin(&self.project, &asked)) {
                    Ok(number) => Answer::json(&json!({ "job": number })),
                    Err(problem) => Answer::refused(400, problem),
                }
            }
            (Method::Get, ["jobs", number]) => {
                let state = number
                    .parse()
                    .ok()
                    .and_then(|number| self.jobs.state(&self.project, number));
                state.map_or_else(
                    || Answer::refused(404, "there is no such command"),
                    |state| Answer::json(&state),
                )
            }
            (Method::Delete, ["jobs", number]) => {
                match number
                    .parse()
                    .is_ok_and(|number| self.jobs.cancel(&self.project, number))
                {
                    true => Answer::json(&json!({})),
                    false => Answer::refused(404, "there is no such command"),
                }
            }
            _ => Answer::refused(404, "there is nothing here"),
        }
    }

    /// The path behind the token, of a request by the app's own page; `None` for all others.
    fn own_path(&self, request: &Request) -> Option<String> {
        let header = |name: &'static str| {
            let found = request.headers().iter().find(|header| header.field.equiv(name));
            found.map(|header| header.value.as_str())
        };
        let origin = format!("http://{}", self.host);
        // A name that leads here, or a page of elsewhere that asks for something here, is not the app's.
        let is_own = header("Host") == Some(&self.host)
            && header("Origin").is_none_or(|found| found == origin)
            && header("Sec-Fetch-Site").is_none_or(|site| ["same-origin", "none"].contains(&site));
        let rest = request.url().strip_prefix('/')?;
        let (token, path) = rest.split_once('/')?;
        // Every byte is compared, so that the time says nothing of where they differ.
        let differs = token
            .bytes()
            .zip(self.token.bytes())
            .fold(0, |all, (a, b)| all | (a ^ b));
        (is_own && token.len() == self.token.len() && differs == 0).then(|| path.to_owned())
    }

    fn project_answer(&self) -> Answer {
        let structures = structures()
            .iter()
            .map(|s| json!({ "name": s.name.key, "description": s.description }));
        let formats = Format::ALL
            .iter()
            .map(|f| json!({ "name": f.name, "description": f.description, "arm": f.value.takes_arms() }));
        let estimators = EstimatorName::ALL
            .iter()
            .map(|e| json!({ "name": e.name(), "description": e.title() }));
        match self.project.files() {
            Err(error) => Answer::refused(500, error.to_string()),
            Ok(files) => Answer::json(&json!({
                "folder": self.project.folder.display().to_string(),
                "files": files,
                "structures": structures.collect::<Vec<_>>(),
                "formats": formats.collect::<Vec<_>>(),
                "estimators": estimators.collect::<Vec<_>>(),
            })),
        }
    }

    fn file(&self, name: &str, download: bool) -> Answer {
        let Some(file) = self.project.open(name) else {
            return Answer::refused(404, format!("there is no file '{name}'"));
        };
        let is_page = name.to_ascii_lowercase().ends_with(".html") && !download;
        Answer {
            status: 200,
            kind: if is_page {
                "text/html; charset=utf-8"
            } else {
                "application/octet-stream"
            },
            policy: FOREIGN,
            content: Content::File(file),
            download: (!is_page).then(|| name.to_owned()),
        }
    }
}

/// A part of a path without its percent signs; `None` where it is no text.
fn decoded(part: &str) -> Option<String> {
    let mut bytes = Vec::new();
    let mut rest = part.bytes();
    while let Some(byte) = rest.next() {
        match byte {
            b'%' => {
                let digits = [rest.next()?, rest.next()?];
                let digits = std::str::from_utf8(&digits).ok()?;
                bytes.push(u8::from_str_radix(digits, 16).ok()?);
            }
            other => bytes.push(other),
        }
    }
    String::from_utf8(bytes).ok()
}
