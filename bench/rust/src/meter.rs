//! Processor time, wall time and memory of a call, inside the process.

use std::time::Instant;

use cpu_time::ProcessTime;

/// Processor time (user and system, all threads) and wall time.
pub struct Stopwatch {
    cpu: ProcessTime,
    wall: Instant,
}

impl Stopwatch {
    pub fn start() -> Stopwatch {
        Stopwatch {
            cpu: ProcessTime::now(),
            wall: Instant::now(),
        }
    }

    /// Processor and wall time since the start, s.
    pub fn stop(self) -> (f64, f64) {
        (self.cpu.elapsed().as_secs_f64(), self.wall.elapsed().as_secs_f64())
    }
}

/// The resident memory at the start of a call.
pub struct Memory {
    before: u64,
}

impl Memory {
    /// Forgets the peak so far. `None` if the system does not report it.
    pub fn start() -> Option<Memory> {
        // Resets VmHWM (Linux, proc(5)).
        std::fs::write("/proc/self/clear_refs", "5").ok()?;
        Some(Memory {
            before: status("VmRSS:")?,
        })
    }

    /// The peak resident memory since the start minus the memory at the start, bytes.
    pub fn peak(self) -> Option<u64> {
        Some(status("VmHWM:")?.saturating_sub(self.before))
    }
}

fn status(field: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(field))?;
    let kibibytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(1024 * kibibytes)
}
