//! The part of HTTP/1.1 that the page needs: one request per connection, with a body of declared length.
//!
//! No incoming data are trusted: the length of a head, the time for it and the number of connections are limited.

use std::fs::File;
use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// The most connections at once; the page has a few.
const MOST_CONNECTIONS: usize = 128;
/// The longest head of a request, bytes, and its most fields.
const LONGEST_HEAD: usize = 16 << 10;
const MOST_FIELDS: usize = 64;
/// How long a head may take.
const HEAD: Duration = Duration::from_secs(5);
/// How long the other side may be silent within a body or an answer.
const SILENCE: Duration = Duration::from_secs(30);
/// How long unneeded data are still read, so that the other side gets the answer.
const LINGER: Duration = Duration::from_secs(10);

/// What is asked for.
pub struct Request {
    /// `GET`, `PUT`, ...
    pub method: String,
    /// The path, with the query.
    pub target: String,
    fields: Vec<(String, String)>,
    /// What comes behind the head.
    pub body: Body,
}

impl Request {
    /// The values of a field of the head.
    pub fn fields(&self, name: &str) -> impl Iterator<Item = &str> {
        let found = self
            .fields
            .iter()
            .filter(move |(own, _)| own.eq_ignore_ascii_case(name));
        found.map(|(_, value)| value.as_str())
    }
}

/// A request's body: the part that came with the head, and then the rest.
pub struct Body {
    stream: TcpStream,
    begun: io::Cursor<Vec<u8>>,
    /// Its length, bytes.
    pub length: u64,
    left: u64,
    /// The other side waits until it is asked for it.
    waits: bool,
}

impl Read for Body {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if std::mem::take(&mut self.waits) {
            self.stream.write_all(b"HTTP/1.1 100 Continue\r\n\r\n")?;
        }
        let most = buffer.len().min(usize::try_from(self.left).unwrap_or(usize::MAX));
        let buffer = &mut buffer[..most];
        if buffer.is_empty() {
            // A further read would wait for a byte that never comes.
            return Ok(0);
        }
        let read = match self.begun.read(buffer)? {
            0 => self.stream.read(buffer)?,
            some => some,
        };
        self.left -= read as u64;
        Ok(read)
    }
}

/// An answer.
pub struct Answer {
    pub status: u16,
    pub fields: Vec<(&'static str, String)>,
    pub content: Content,
}

pub enum Content {
    Bytes(Vec<u8>),
    File(File),
}

impl Answer {
    /// One without content.
    fn empty(status: u16) -> Self {
        Answer {
            status,
            fields: Vec::new(),
            content: Content::Bytes(Vec::new()),
        }
    }

    fn write(self, stream: &mut TcpStream) -> io::Result<()> {
        let length = match &self.content {
            Content::Bytes(bytes) => bytes.len() as u64,
            Content::File(file) => file.metadata()?.len(),
        };
        let mut head = format!("HTTP/1.1 {} {}\r\n", self.status, reason(self.status));
        for (name, value) in &self.fields {
            head.push_str(&format!("{name}: {value}\r\n"));
        }
        head.push_str(&format!("Content-Length: {length}\r\nConnection: close\r\n\r\n"));
        stream.write_all(head.as_bytes())?;
        match self.content {
            Content::Bytes(bytes) => stream.write_all(&bytes),
            Content::File(file) => io::copy(&mut file.take(length), stream).map(drop),
        }
    }
}

fn reason(status: u16) -> &'static str {
    match status {
        200 => "OK",
        303 => "See Other",
        400 => "Bad Request",
        403 => "Forbidden",
        404 => "Not Found",
        408 => "Request Timeout",
        411 => "Length Required",
        413 => "Content Too Large",
        431 => "Request Header Fields Too Large",
        503 => "Service Unavailable",
        _ => "Internal Server Error",
    }
}

/// Answers until the process ends. Every connection has its own thread.
pub fn serve(listener: &TcpListener, answer: &(dyn Fn(&mut Request) -> Answer + Sync)) {
    let open = AtomicUsize::new(0);
    std::thread::scope(|scope| {
        for stream in listener.incoming() {
            let Ok(mut stream) = stream else {
                // No file descriptor is free now: wait.
                std::thread::sleep(Duration::from_millis(50));
                continue;
            };
            if open.fetch_add(1, Ordering::Relaxed) >= MOST_CONNECTIONS {
                open.fetch_sub(1, Ordering::Relaxed);
                let _ = stream.set_nonblocking(true);
                let _ = Answer::empty(503).write(&mut stream);
                continue;
            }
            let begun = std::thread::Builder::new().spawn_scoped(scope, || {
                // The client may have gone.
                let _ = connection(stream, answer);
                open.fetch_sub(1, Ordering::Relaxed);
            });
            if begun.is_err() {
                open.fetch_sub(1, Ordering::Relaxed);
            }
        }
    });
}

fn connection(mut stream: TcpStream, answer: &dyn Fn(&mut Request) -> Answer) -> io::Result<()> {
    let request = read(&stream);
    stream.set_read_timeout(Some(SILENCE))?;
    stream.set_write_timeout(Some(SILENCE))?;
    match request {
        Ok(Some(mut request)) => answer(&mut request).write(&mut stream)?,
        Ok(None) => return Ok(()),
        Err(status) => Answer::empty(status).write(&mut stream)?,
    }
    // If the connection were closed with unread data, the answer would be lost.
    stream.shutdown(Shutdown::Write)?;
    let (end, mut buffer) = (Instant::now() + LINGER, vec![0; 64 << 10]);
    while wait_until(&stream, end) && stream.read(&mut buffer)? > 0 {}
    Ok(())
}

/// Limits the wait of a read to `end`; false if `end` has passed.
fn wait_until(stream: &TcpStream, end: Instant) -> bool {
    let left = end.saturating_duration_since(Instant::now());
    !left.is_zero() && stream.set_read_timeout(Some(left)).is_ok()
}

/// The request; `None` if the other side sends nothing, and a status code if what it sends is no request.
fn read(stream: &TcpStream) -> Result<Option<Request>, u16> {
    let end = Instant::now() + HEAD;
    let mut bytes = Vec::new();
    let mut buffer = [0; 4096];
    loop {
        let read = match wait_until(stream, end) {
            true => (&*stream).read(&mut buffer).map_err(|_| 408_u16),
            false => Err(408),
        };
        match read {
            Ok(0) | Err(_) if bytes.is_empty() => return Ok(None),
            Ok(0) => return Err(400),
            read => bytes.extend_from_slice(&buffer[..read?]),
        }
        let mut fields = [httparse::EMPTY_HEADER; MOST_FIELDS];
        let mut head = httparse::Request::new(&mut fields);
        match head.parse(&bytes) {
            Ok(httparse::Status::Complete(length)) => {
                let text = |value: &[u8]| String::from_utf8(value.to_vec()).map_err(|_| 400_u16);
                let fields = head
                    .headers
                    .iter()
                    .map(|field| Ok((field.name.to_owned(), text(field.value)?)));
                let fields: Vec<(String, String)> = fields.collect::<Result<_, u16>>()?;
                let (method, target) = (head.method.unwrap_or_default(), head.path.unwrap_or_default());
                let (method, target) = (method.to_owned(), target.to_owned());
                let body = body(stream, bytes.split_off(length), &fields)?;
                return Ok(Some(Request {
                    method,
                    target,
                    fields,
                    body,
                }));
            }
            Ok(httparse::Status::Partial) if bytes.len() <= LONGEST_HEAD => {}
            Ok(httparse::Status::Partial) | Err(httparse::Error::TooManyHeaders) => return Err(431),
            Err(_) => return Err(400),
        }
    }
}

/// What is behind the head.
fn body(stream: &TcpStream, begun: Vec<u8>, fields: &[(String, String)]) -> Result<Body, u16> {
    let all = |name: &'static str| fields.iter().filter(move |(own, _)| own.eq_ignore_ascii_case(name));
    if all("Transfer-Encoding").next().is_some() {
        return Err(411);
    }
    let mut lengths = all("Content-Length").map(|(_, value)| value.trim());
    let length = match (lengths.next(), lengths.next()) {
        (None, _) => 0,
        (Some(digits), None) if !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()) => {
            digits.parse().map_err(|_| 413_u16)?
        }
        _ => return Err(400),
    };
    Ok(Body {
        stream: stream.try_clone().map_err(|_| 503_u16)?,
        begun: io::Cursor::new(begun),
        length,
        left: length,
        waits: all("Expect").next().is_some(),
    })
}
