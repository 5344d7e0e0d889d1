//! What is asked for, and the answers.

use std::io::Read;
use std::sync::{Mutex, PoisonError};

use flexure::identify::structures;
use flexure::nonlinearity::EstimatorName;
use flexure_export::Format;
use flexure_workbench::Named;
use serde_json::{Value, json};

use super::http::{Answer, Content, Request};
use super::jobs::{self, Jobs};
use super::project::{self, Project, Refusal};

/// The longest request that is not an upload, bytes.
const LONGEST_REQUEST: u64 = 64 << 10;

/// What the page may do: load its own parts, and show pages of the project in frames.
const OWN: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; frame-src 'self'; \
                   form-action 'none'; base-uri 'none'; frame-ancestors 'none'";
/// A page of the project may only show itself. It has no origin, so it has no access to the app.
const FOREIGN: &str = "sandbox allow-scripts allow-downloads; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; \
                       img-src data: blob:; font-src data:; frame-ancestors 'self'";

/// The app: where it is, and what it works on.
pub struct App {
    /// The address that browsers name: `127.0.0.1:PORT`.
    pub host: String,
    pub token: String,
    /// A path that leads to the page once. The app starts the browser with it.
    pub entrance: Mutex<Option<String>>,
    pub project: Project,
    pub jobs: Jobs,
}

/// An answer of this kind, under a policy.
fn answer(status: u16, kind: &str, policy: &str, content: Content) -> Answer {
    let fields = [
        ("Content-Type", kind),
        ("Content-Security-Policy", policy),
        ("Cache-Control", "no-store"),
        ("Referrer-Policy", "no-referrer"),
        ("X-Content-Type-Options", "nosniff"),
        ("Cross-Origin-Resource-Policy", "same-origin"),
    ];
    Answer {
        status,
        fields: fields.map(|(name, value)| (name, value.to_owned())).to_vec(),
        content,
    }
}

fn bytes(status: u16, kind: &str, content: impl Into<Vec<u8>>) -> Answer {
    answer(status, kind, OWN, Content::Bytes(content.into()))
}

fn as_json(value: &Value) -> Answer {
    bytes(200, "application/json", value.to_string())
}

fn refused(status: u16, problem: impl Into<String>) -> Answer {
    bytes(
        status,
        "application/json",
        json!({ "problem": problem.into() }).to_string(),
    )
}

impl App {
    pub fn answer(&self, request: &mut Request) -> Answer {
        if self.enters(request) {
            let mut answer = bytes(303, "text/plain", "");
            answer.fields.push(("Location", format!("/{}/", self.token)));
            return answer;
        }
        let Some(path) = self.own_path(request) else {
            return bytes(403, "text/plain", "");
        };
        let (path, query) = path.split_once('?').unwrap_or((&path, ""));
        let parts: Vec<String> = path.split('/').filter_map(decoded).collect();
        let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
        match (request.method.as_str(), &parts[..]) {
            ("GET", [""]) => bytes(200, "text/html; charset=utf-8", include_str!("page.html")),
            ("GET", ["app.js"]) => bytes(200, "text/javascript; charset=utf-8", include_str!("page.js")),
            ("GET", ["app.css"]) => {
                let style = [flexure_report::STYLE, include_str!("page.css")].concat();
                bytes(200, "text/css; charset=utf-8", style)
            }
            ("GET", ["project"]) => self.project_answer(),
            ("GET", ["files", name]) => self.file(name, query == "download"),
            ("PUT", ["files", name]) => {
                let length = request.body.length;
                match self.project.keep(name, length, &mut request.body) {
                    Ok(name) => as_json(&json!({ "name": name })),
                    Err(Refusal::Name) => refused(400, project::no_name(name)),
                    Err(Refusal::Size) => refused(413, "the file is too large; --largest-file SIZE allows more"),
                    Err(Refusal::Failed(problem)) => refused(500, problem),
                }
            }
            ("POST", ["jobs"]) => {
                let mut text = Vec::new();
                let read = (&mut request.body).take(LONGEST_REQUEST).read_to_end(&mut text);
                let asked = read.map_err(|e| e.to_string());
                let asked =
                    asked.and_then(|_| serde_json::from_slice::<jobs::Request>(&text).map_err(|e| e.to_string()));
                match asked.and_then(|asked| self.jobs.begin(&self.project, &asked)) {
                    Ok(number) => as_json(&json!({ "job": number })),
                    Err(problem) => refused(400, problem),
                }
            }
            ("GET", ["jobs", number]) => {
                let state = number
                    .parse()
                    .ok()
                    .and_then(|number| self.jobs.state(&self.project, number));
                state.map_or_else(|| refused(404, "there is no such command"), |state| as_json(&state))
            }
            ("DELETE", ["jobs", number]) => {
                match number
                    .parse()
                    .is_ok_and(|number| self.jobs.cancel(&self.project, number))
                {
                    true => as_json(&json!({})),
                    false => refused(404, "there is no such command"),
                }
            }
            _ => refused(404, "there is nothing here"),
        }
    }

    /// Whether the request is the first one for the entrance address: that of the browser which the app has started.
    fn enters(&self, request: &Request) -> bool {
        let mut entrance = self.entrance.lock().unwrap_or_else(PoisonError::into_inner);
        let asked = request.target.strip_prefix('/').unwrap_or_default();
        let enters = self.is_own(request) && entrance.as_deref().is_some_and(|own| same(own, asked));
        if enters {
            *entrance = None;
        }
        enters
    }

    /// Whether a request comes from the app's own page, not from another site's page or under another host name.
    fn is_own(&self, request: &Request) -> bool {
        let origin = format!("http://{}", self.host);
        request.fields("Host").eq([&*self.host])
            && request.fields("Origin").all(|found| found == origin)
            && (request.fields("Sec-Fetch-Site")).all(|site| ["same-origin", "none"].contains(&site))
    }

    /// The path behind the token, of a request by the app's own page; `None` for all others.
    fn own_path(&self, request: &Request) -> Option<String> {
        let rest = request.target.strip_prefix('/')?;
        let (token, path) = rest.split_once('/')?;
        (self.is_own(request) && same(&self.token, token)).then(|| path.to_owned())
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
            Err(error) => refused(500, error.to_string()),
            Ok(files) => as_json(&json!({
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
            return refused(404, format!("there is no file '{name}'"));
        };
        if name.to_ascii_lowercase().ends_with(".html") && !download {
            return answer(200, "text/html; charset=utf-8", FOREIGN, Content::File(file));
        }
        let mut answer = answer(200, "application/octet-stream", FOREIGN, Content::File(file));
        let encoded: String = name.bytes().map(|byte| format!("%{byte:02X}")).collect();
        let disposition = format!("attachment; filename*=UTF-8''{encoded}");
        answer.fields.push(("Content-Disposition", disposition));
        answer
    }
}

/// Compares every byte, so that the time does not show where they differ.
fn same(secret: &str, given: &str) -> bool {
    let differences = secret.bytes().zip(given.bytes()).fold(0, |all, (a, b)| all | (a ^ b));
    secret.len() == given.len() && differences == 0
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
