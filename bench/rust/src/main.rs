//! One contestant of the comparison, in a process of its own: `flexure-bench WHO key=value...`.
//!
//! It reads the data, does the job once with few points, says `ready` and then obeys the lines on its standard
//! input as `worker.py` does for the Python peers (the protocol is described there).

#[cfg(feature = "peers")]
mod fdars;
mod flexure;
mod job;
mod meter;

use std::io::{BufRead, Write};
use std::time::{Duration, Instant};

use job::{Call, Data, Job, Outcome, Result};
use meter::{Memory, Stopwatch};

/// Points of the first, unmeasured call.
const WARM_UP: usize = 256;

fn main() {
    if let Err(error) = serve() {
        say(&format!("error {error}"));
        std::process::exit(1);
    }
}

fn serve() -> Result<()> {
    // This thread works too: the system counts the time of others only when it next looks at them, too late for short calls.
    rayon::ThreadPoolBuilder::new().use_current_thread().build_global()?;
    let mut arguments = std::env::args().skip(1);
    let who = arguments.next().ok_or("whose turn it is, is missing")?;
    let job = Job::parse(arguments)?;
    let call = contestant(&who, &job)?;
    let data = Data::read(&job)?;
    call(&data.first(WARM_UP))?;
    say("ready");
    let mut last = None;
    for line in std::io::stdin().lock().lines() {
        match line?.split_once(' ') {
            Some(("run", seconds)) => {
                let (outcome, report) = turn(&call, &data, Duration::from_secs_f64(seconds.parse()?))?;
                last = Some(outcome);
                say(&report);
            }
            Some(("write", path)) => {
                let outcome: &Outcome = last.as_ref().ok_or("nothing has been run yet")?;
                let bytes: Vec<u8> = outcome.estimates.iter().flat_map(|v| v.to_le_bytes()).collect();
                std::fs::write(path, bytes)?;
                say("written");
            }
            _ => return Err("expected `run SECONDS` or `write PATH`".into()),
        }
    }
    Ok(())
}

fn contestant(who: &str, job: &Job) -> Result<Call> {
    match who {
        "flexure" => flexure::call(job),
        #[cfg(feature = "peers")]
        "fdars" => fdars::call(job),
        _ => Err(format!("{who} is not known here").into()),
    }
}

/// Repeats the call for `length`, and at least once. Returns the last outcome, and a line with the least processor and wall time in
/// seconds, the first call's peak memory in bytes and the chosen parameter.
fn turn(call: &Call, data: &Data, length: Duration) -> Result<(Outcome, String)> {
    let begin = Instant::now();
    let (mut cpu, mut wall) = (f64::INFINITY, f64::INFINITY);
    let mut peak = None;
    loop {
        let memory = Memory::start();
        let watch = Stopwatch::start();
        let outcome = call(data)?;
        let (c, w) = watch.stop();
        peak = peak.or(memory.and_then(Memory::peak));
        (cpu, wall) = (cpu.min(c), wall.min(w));
        if begin.elapsed() >= length {
            let peak = peak.map_or("-".to_owned(), |p| p.to_string());
            let chosen = outcome.chosen.clone().unwrap_or("-".to_owned());
            return Ok((outcome, format!("took {cpu} {wall} {peak} {chosen}")));
        }
    }
}

fn say(line: &str) {
    let mut out = std::io::stdout().lock();
    // Nobody listens any more: the next read of the standard input ends the process.
    let _ = writeln!(out, "{line}").and_then(|()| out.flush());
}
