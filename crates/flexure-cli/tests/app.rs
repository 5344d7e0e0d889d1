//! The app's server: what is no request of its own page is refused, and ends nothing.

mod common;

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::process::{Child, Stdio};
use std::time::Duration;

use common::Folder;
use serde_json::Value;

/// A running app. Its project is the folder `project`; a file next to that folder does not belong to it.
struct App {
    child: Child,
    folder: Folder,
    host: String,
    token: String,
}

impl App {
    fn new(options: &str) -> Self {
        let folder = Folder::new();
        folder.write("outside.csv", "secret");
        let mut command = folder.command(&format!("app project --no-open {options}"));
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap())
            .read_line(&mut line)
            .unwrap();
        let address = line.trim().strip_prefix("http://").unwrap().trim_end_matches('/');
        let (host, token) = address.split_once('/').unwrap();
        let (host, token) = (host.to_owned(), token.to_owned());
        App {
            child,
            folder,
            host,
            token,
        }
    }

    fn connected(&self) -> TcpStream {
        let stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        stream
    }

    /// The status and the text of the answer to these bytes; 0 where there is none.
    fn raw(&self, bytes: &[u8]) -> (u16, String) {
        let mut stream = self.connected();
        // It may have answered before all is written.
        let _ = stream.write_all(bytes);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        let answer = String::from_utf8_lossy(&answer).into_owned();
        let status = answer.split(' ').nth(1).and_then(|word| word.parse().ok());
        (status.unwrap_or(0), answer)
    }

    /// As [`raw`](Self::raw), for a request of the page itself.
    fn asked(&self, method: &str, path: &str, body: &str) -> (u16, String) {
        let (host, token, length) = (&self.host, &self.token, body.len());
        let head = format!("{method} /{token}/{path} HTTP/1.1\r\nHost: {host}\r\nContent-Length: {length}\r\n\r\n");
        self.raw((head + body).as_bytes())
    }

    fn files(&self) -> Vec<String> {
        let (status, answer) = self.asked("GET", "project", "");
        assert_eq!(status, 200, "{answer}");
        let (_, body) = answer.split_once("\r\n\r\n").unwrap();
        let project: Value = serde_json::from_str(body).unwrap();
        let names = project["files"].as_array().unwrap().iter();
        names.map(|file| file["name"].as_str().unwrap().to_owned()).collect()
    }
}

impl Drop for App {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn what_is_no_request_is_refused() {
    let app = App::new("");
    let (host, token) = (&app.host, &app.token);
    let own = |method: &str, path: &str, fields: &str| {
        format!("{method} /{token}/{path} HTTP/1.1\r\nHost: {host}\r\n{fields}\r\n").into_bytes()
    };
    let wrong = "0".repeat(token.len());
    let many = "a: b\r\n".repeat(200);
    let long = format!("a: {}\r\n", "b".repeat(100_000));
    for (request, status) in [
        (b"GARBAGE\r\n\r\n".to_vec(), 400),
        (b"\0\xff\x16\x03\x01\r\n\r\n".to_vec(), 400),
        (b"GET / HTTP/9.9\r\n\r\n".to_vec(), 400),
        ([b"GET /".to_vec(), vec![b'a'; 1 << 20]].concat(), 431),
        (own("GET", "", &many), 431),
        (own("GET", "", &long), 431),
        (own("GET", "", "no colon\r\n"), 400),
        (own("GET", "", "Name\0: value\r\n"), 400),
        (own("PUT", "files/a.csv", "Content-Length: -1\r\n"), 400),
        (own("PUT", "files/a.csv", "Content-Length:\r\n"), 400),
        (
            own("PUT", "files/a.csv", "Content-Length: 1\r\nContent-Length: 2\r\n"),
            400,
        ),
        (
            own("PUT", "files/a.csv", "Content-Length: 18446744073709551616\r\n"),
            413,
        ),
        (
            own("PUT", "files/a.csv", "Content-Length: 9000000000000000000\r\n"),
            413,
        ),
        (
            own(
                "PUT",
                "files/a.csv",
                "Transfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n0\r\n",
            ),
            411,
        ),
        (
            own(
                "PUT",
                "files/a.csv",
                "Content-Length: 5\r\nTransfer-Encoding: chunked\r\n",
            ),
            411,
        ),
        (own("POST", "jobs", "Content-Length: 3\r\n\r\n{]}"), 400),
        (own("TRACE", "project", ""), 404),
        (own("GET", "files/..%2Foutside.csv", ""), 404),
        (own("GET", "files/%2E%2E/outside.csv", ""), 404),
        (own("GET", "../../etc/passwd", ""), 404),
        (own("GET", "files/%00%zz%", ""), 404),
        (own("GET", "jobs/99999999999999999999999", ""), 404),
        (own("GET", "project", "Origin: http://elsewhere.example\r\n"), 403),
        (format!("GET /{token}/project HTTP/1.1\r\n\r\n").into_bytes(), 403),
        (
            format!("GET /{token}/project HTTP/1.1\r\nHost: elsewhere.example\r\n\r\n").into_bytes(),
            403,
        ),
        (
            format!("GET /{wrong}/project HTTP/1.1\r\nHost: {host}\r\n\r\n").into_bytes(),
            403,
        ),
        // A request of such a length is not read, and no memory is taken for it.
        (
            format!("POST /{wrong}/jobs HTTP/1.1\r\nHost: {host}\r\nContent-Length: 9000000000000000000\r\n\r\n")
                .into_bytes(),
            403,
        ),
    ] {
        // Sent whole, and then nothing more comes.
        let mut stream = app.connected();
        let _ = stream.write_all(&request);
        let _ = stream.shutdown(Shutdown::Write);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        let answer = String::from_utf8_lossy(&answer).into_owned();
        let start = String::from_utf8_lossy(&request[..request.len().min(150)]).into_owned();
        assert!(
            answer.starts_with(&format!("HTTP/1.1 {status} ")),
            "{start:?}: {answer}"
        );
        assert_eq!(app.files(), Vec::<String>::new(), "{start:?}");
    }
}

#[test]
fn names_of_uploads_stay_in_the_project() {
    let app = App::new("--largest-file 1KiB");
    for name in [
        "..",
        "%2E%2E%2Foutside.csv",
        "..%5Coutside.csv",
        "a%00b",
        "a%0Ab.csv",
        ".hidden",
        "-rf",
        "c:x.csv",
        "",
        "%FF.csv",
    ] {
        let (status, answer) = app.asked("PUT", &format!("files/{name}"), "t,y\n");
        assert!(matches!(status, 400 | 404), "{name}: {answer}");
    }
    assert_eq!(app.asked("PUT", &format!("files/{}", "n".repeat(300)), "x").0, 400);
    assert_eq!(app.asked("PUT", "files/large.csv", &"x".repeat(1025)).0, 413);
    assert_eq!(app.files(), Vec::<String>::new());
    // What may be in a name stays text, in the list and in the answer's head.
    let html = "\"><img src=x onerror=alert(1)>.csv";
    let encoded: String = html.bytes().map(|byte| format!("%{byte:02X}")).collect();
    assert_eq!(app.asked("PUT", &format!("files/{encoded}"), "t,y\n").0, 200);
    assert_eq!(app.files(), [html]);
    let (status, answer) = app.asked("GET", &format!("files/{encoded}"), "");
    assert!(status == 200 && !answer.contains("<img"), "{answer}");
    #[cfg(unix)]
    for (target, link) in [("../new.csv", "new.csv"), ("../outside.csv", "read.csv")] {
        std::os::unix::fs::symlink(target, app.folder.path("project").join(link)).unwrap();
        assert_eq!(app.asked("GET", &format!("files/{link}"), "").0, 404);
        let (status, answer) = app.asked("PUT", &format!("files/{link}"), "mine");
        assert!(status == 200 && answer.contains("-2.csv"), "{answer}");
    }
    assert!(!app.folder.path("new.csv").exists());
    assert_eq!(app.folder.read("outside.csv"), "secret");
}

#[test]
fn an_upload_that_ends_early_leaves_nothing() {
    let app = App::new("");
    let head = format!(
        "PUT /{}/files/half.csv HTTP/1.1\r\nHost: {}\r\nContent-Length: 1000\r\n\r\n",
        app.token, app.host
    );
    let mut stream = app.connected();
    stream.write_all((head + "t,y\n").as_bytes()).unwrap();
    stream.shutdown(Shutdown::Write).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    assert!(
        answer.starts_with("HTTP/1.1 500") && answer.contains("ended early"),
        "{answer}"
    );
    assert_eq!(std::fs::read_dir(app.folder.path("project")).unwrap().count(), 0);
}

/// Whoever opens connections and says nothing is let go; meanwhile they take a bounded number of threads.
#[test]
fn connections_without_a_request_are_let_go() {
    let app = App::new("");
    let mut idle: Vec<TcpStream> = (0..400).map(|_| app.connected()).collect();
    for (k, stream) in idle.iter_mut().enumerate().filter(|(k, _)| k % 2 == 0) {
        let _ = stream.write_all(&b"GET / HTTP/1.1\r\nHost: "[..k % 20]);
    }
    if let Ok(status) = std::fs::read_to_string(format!("/proc/{}/status", app.child.id())) {
        let threads = status.lines().find_map(|line| line.strip_prefix("Threads:")).unwrap();
        assert!(threads.trim().parse::<usize>().unwrap() < 150, "{threads}");
    }
    for mut stream in idle {
        let mut answer = Vec::new();
        // Closed with an answer or without one; it ends before this side's patience.
        if let Err(error) = stream.read_to_end(&mut answer) {
            assert_eq!(error.kind(), std::io::ErrorKind::ConnectionReset);
        }
    }
    assert_eq!(app.files(), Vec::<String>::new());
}

#[test]
fn a_project_that_is_removed_is_an_error() {
    let app = App::new("");
    assert_eq!(app.asked("PUT", "files/a.csv", "t,y\n0,1\n").0, 200);
    std::fs::remove_dir_all(app.folder.path("project")).unwrap();
    let look = r#"{"command": "look", "files": ["a.csv"]}"#;
    let study = r#"{"command": "look", "files": []}"#;
    for (method, path, body, status) in [
        ("GET", "project", "", 500),
        ("GET", "files/a.csv", "", 404),
        ("PUT", "files/b.csv", "t,y\n", 500),
        ("POST", "jobs", look, 400),
        ("POST", "jobs", study, 400),
    ] {
        let answer = app.asked(method, path, body);
        assert_eq!(answer.0, status, "{method} {path}: {}", answer.1);
        assert!(answer.1.contains("problem"), "{}", answer.1);
    }
}
