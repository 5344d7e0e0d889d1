//! Commands as child processes: what was asked for, how far it is, what it printed.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read, Write as _};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use flexure::text::shown_path;
use flexure_io::write_atomically;
use serde::Deserialize;
use serde_json::{Value, json};

use super::project::{Project, header, no_name};
use crate::progress::{LINES, MARK};

/// The commands that can be asked for.
const COMMANDS: [&str; 8] = [
    "look", "prepare", "identify", "compare", "report", "export", "joint", "regress",
];
/// Their options that name no file.
const OPTIONS: [&str; 40] = [
    "input",
    "output",
    "structure",
    "method",
    "order",
    "delay",
    "fresh",
    "sample-time",
    "time",
    "topic",
    "joint",
    "separator",
    "decimal",
    "header",
    "skip-lines",
    "time-format",
    "missing-text",
    "keep",
    "cut",
    "resample",
    "hold",
    "low-pass",
    "fill",
    "outliers",
    "detrend",
    "remove-mean",
    "to",
    "name",
    "fmi",
    "x",
    "y",
    "position",
    "torque",
    "motor",
    "link",
    "torque-constant",
    "gear-ratio",
    "motor-inertia",
    "estimator",
    "band",
];
/// Their options without a value.
const SWITCHES: [&str; 5] = ["gravity", "spring", "prismatic", "missing", "robust"];
/// Their options that name a file to write.
const OUTPUTS: [&str; 6] = ["out", "model", "report", "friction", "stiffness", "arm"];
/// The file that keeps the object that a command prints.
const OBJECT: &str = "json";
/// The most commands at once.
const MOST_RUNNING: usize = 4;
/// The most that is kept of what a command says, bytes.
const LONGEST: u64 = 8 << 20;
/// The most commands that are remembered.
const MOST_KEPT: usize = 200;

/// What the page asks for.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    command: String,
    files: Vec<String>,
    #[serde(default)]
    options: BTreeMap<String, String>,
    #[serde(default)]
    outputs: BTreeMap<String, String>,
    #[serde(default)]
    json: bool,
}

/// A command that runs or ran.
struct Job {
    title: String,
    child: Child,
    started: Instant,
    seconds: f64,
    /// Its exit code, once it has ended; none where it was cancelled.
    ended: Option<Option<i32>>,
    cancelled: bool,
    outputs: BTreeMap<String, String>,
    printed: Arc<Mutex<Printed>>,
}

/// What a command has printed.
#[derive(Default)]
struct Printed {
    result: String,
    progress: String,
    messages: String,
    open: usize,
    /// The result is longer than what is kept.
    is_cut: bool,
}

/// All commands.
#[derive(Default)]
pub struct Jobs(Mutex<(u64, BTreeMap<u64, Job>)>);

impl Jobs {
    fn all(&self) -> MutexGuard<'_, (u64, BTreeMap<u64, Job>)> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins a command; returns its number.
    ///
    /// # Errors
    /// What is wrong with the request.
    pub fn begin(&self, project: &Project, request: &Request) -> Result<u64, String> {
        self.look(project);
        let mut all = self.all();
        let (last, jobs) = &mut *all;
        if jobs.values().filter(|job| job.ended.is_none()).count() >= MOST_RUNNING {
            return Err(format!(
                "{MOST_RUNNING} commands are running; wait for one, or cancel one"
            ));
        }
        let outputs = promise(project, &request.outputs)?;
        let begun = arguments(project, request, &outputs).and_then(|arguments| start(project, &arguments));
        let (child, printed) = begun.inspect_err(|_| project.release(outputs.values()))?;
        *last += 1;
        let job = Job {
            title: format!("{} {}", request.command, request.files.join(" ")),
            child,
            started: Instant::now(),
            seconds: 0.0,
            ended: None,
            cancelled: false,
            outputs,
            printed,
        };
        jobs.insert(*last, job);
        while jobs.len() > MOST_KEPT {
            let ended = jobs
                .iter()
                .find(|(_, job)| job.ended.is_some())
                .map(|(number, _)| *number);
            let Some(oldest) = ended else { break };
            jobs.remove(&oldest);
        }
        Ok(*last)
    }

    /// How a command is.
    pub fn state(&self, project: &Project, number: u64) -> Option<Value> {
        let mut all = self.all();
        let job = all.1.get_mut(&number)?;
        job.look(project);
        let printed = job.printed();
        let state = match (job.ended, job.cancelled) {
            (None, _) => "running",
            (_, true) => "cancelled",
            (Some(Some(0)), _) => "done",
            _ => "failed",
        };
        Some(json!({
            "title": job.title,
            "state": state,
            "seconds": job.seconds,
            "progress": printed.progress,
            "result": printed.result,
            "messages": printed.messages,
            "outputs": if state == "done" { json!(job.outputs) } else { json!({}) },
        }))
    }

    /// Ends a command.
    pub fn cancel(&self, project: &Project, number: u64) -> bool {
        let mut all = self.all();
        let Some(job) = all.1.get_mut(&number) else {
            return false;
        };
        job.look(project);
        if job.ended.is_none() {
            job.cancelled = end(&mut job.child);
        }
        true
    }

    /// Notes which commands have ended, and keeps their results.
    pub fn look(&self, project: &Project) {
        for job in self.all().1.values_mut() {
            job.look(project);
        }
    }

    /// Ends all commands.
    pub fn end(&self) {
        for job in self.all().1.values_mut().filter(|job| job.ended.is_none()) {
            end(&mut job.child);
        }
    }
}

/// Asks a process to end. It first removes its temporary files.
fn end(child: &mut Child) -> bool {
    #[cfg(unix)]
    {
        use rustix::process::{Pid, Signal, kill_process};
        let running = matches!(child.try_wait(), Ok(None));
        running && kill_process(Pid::from_child(child), Signal::TERM).is_ok()
    }
    #[cfg(not(unix))]
    child.kill().is_ok()
}

impl Job {
    fn printed(&self) -> MutexGuard<'_, Printed> {
        self.printed.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Notes whether the command has ended and all of its output has arrived. Then keeps what it printed, if that was asked for.
    fn look(&mut self, project: &Project) {
        if self.ended.is_some() {
            return;
        }
        self.seconds = self.started.elapsed().as_secs_f64();
        let Ok(Some(status)) = self.child.try_wait() else {
            return;
        };
        if self.printed().open > 0 {
            return;
        }
        let mut code = status.code();
        if let (Some(0), Some(name)) = (code, self.outputs.get(OBJECT)) {
            let mut printed = self.printed();
            let kept = match printed.is_cut {
                true => Err(format!(
                    "the object is longer than {LONGEST} bytes; the command line prints it"
                )),
                false => write_atomically(project.folder.join(name), |out| {
                    out.write_all(printed.result.as_bytes())
                })
                .map_err(|error| error.to_string()),
            };
            if let Err(problem) = kept {
                printed.messages.push_str(&problem);
                code = None;
            }
        }
        self.ended = Some(code);
        project.release(self.outputs.values());
        // Some files may be missing, such as the friction at a motor that was not measured.
        let header = self.outputs.get("out").and_then(|name| header(name));
        self.outputs.extend(header.map(|name| ("header".to_owned(), name)));
        self.outputs.retain(|_, name| project.open(name).is_some());
    }
}

/// Names for the files to write, which are promised.
fn promise(project: &Project, wanted: &BTreeMap<String, String>) -> Result<BTreeMap<String, String>, String> {
    if let Some(option) = wanted
        .keys()
        .find(|option| !OUTPUTS.contains(&option.as_str()) && *option != OBJECT)
    {
        return Err(format!("there is no option '{option}'"));
    }
    let names: Vec<&str> = wanted.values().map(String::as_str).collect();
    match project.promise(&names) {
        Some(promised) => Ok(wanted.keys().cloned().zip(promised).collect()),
        None => {
            let wrong = names.iter().find(|name| project.path(name).is_none());
            Err(no_name(wrong.unwrap_or(&names[0])))
        }
    }
}

/// The arguments of the program. Every value that is not a file of the project follows an equals sign, so it cannot be another option.
fn arguments(project: &Project, request: &Request, outputs: &BTreeMap<String, String>) -> Result<Vec<String>, String> {
    if !COMMANDS.contains(&request.command.as_str()) {
        return Err(format!("there is no command '{}'", request.command));
    }
    let mut arguments = vec![request.command.clone()];
    for name in &request.files {
        match project.open(name) {
            Some(_) => arguments.push(name.clone()),
            None => return Err(format!("there is no file '{name}' in the project")),
        }
    }
    for (option, value) in &request.options {
        match option.as_str() {
            switch if SWITCHES.contains(&switch) => arguments.push(format!("--{option}")),
            valued if OPTIONS.contains(&valued) => arguments.push(format!("--{option}={value}")),
            _ => return Err(format!("there is no option '{option}'")),
        }
    }
    let files = outputs.iter().filter(|(option, _)| *option != OBJECT);
    arguments.extend(files.map(|(option, name)| format!("--{option}={name}")));
    let object = request.json || outputs.contains_key(OBJECT);
    arguments.extend(object.then(|| "--json".to_owned()));
    Ok(arguments)
}

fn start(project: &Project, arguments: &[String]) -> Result<(Child, Arc<Mutex<Printed>>), String> {
    let program = std::env::current_exe().map_err(|error| error.to_string())?;
    let mut command = Command::new(program);
    command
        .args(arguments)
        .current_dir(&project.folder)
        .env(LINES, "1")
        .env("NO_COLOR", "1");
    command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let unbegun = |error| format!("no command can be begun in {}: {error}", shown_path(&project.folder));
    let mut child = command.spawn().map_err(unbegun)?;
    let printed = Arc::new(Mutex::new(Printed {
        open: 2,
        ..Printed::default()
    }));
    let (out, err) = (child.stdout.take(), child.stderr.take());
    let theirs = printed.clone();
    std::thread::spawn(move || {
        let (mut text, mut is_cut) = (Vec::new(), false);
        if let Some(mut out) = out {
            let _ = (&mut out).take(LONGEST).read_to_end(&mut text);
            // Output beyond the limit is read, so that the command can end, and dropped.
            is_cut = std::io::copy(&mut out, &mut std::io::sink()).is_ok_and(|beyond| beyond > 0);
        }
        let mut printed = theirs.lock().unwrap_or_else(PoisonError::into_inner);
        printed.is_cut = is_cut;
        printed.result = String::from_utf8_lossy(&text).into_owned();
        printed.open -= 1;
    });
    let theirs = printed.clone();
    std::thread::spawn(move || {
        for line in err
            .into_iter()
            .flat_map(|err| BufReader::new(err).lines())
            .map_while(Result::ok)
        {
            let mut printed = theirs.lock().unwrap_or_else(PoisonError::into_inner);
            match line.strip_prefix(MARK) {
                Some(progress) => printed.progress = progress.to_owned(),
                None if (printed.messages.len() as u64) < LONGEST => printed.messages.extend([line.as_str(), "\n"]),
                None => {}
            }
        }
        theirs.lock().unwrap_or_else(PoisonError::into_inner).open -= 1;
    });
    Ok((child, printed))
}
