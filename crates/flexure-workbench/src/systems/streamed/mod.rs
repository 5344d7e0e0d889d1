//! A Hammerstein system from a record that memory does not hold: a Parquet file that is read in parts, once for every step of the fit.

mod survey;

use std::ops::Range;
use std::path::Path;

use anyhow::Result;
use flexure::Record;
use flexure::identify::{HammersteinMethod, RefinedHammerstein, Request, ShardPoint, ShardSums, ShardedHammerstein};
use flexure::simulation::batch;
use flexure_io::{ParquetParts, RecordFile};

use self::survey::Survey;
use super::task::{Identified, Task};
use crate::text::grouped;

/// Samples of the excerpts that show order, delay and breakpoints, and of the record's end that is kept in memory.
const EXCERPT_SAMPLES: u64 = 1_000_000;
/// The number of excerpts, spread evenly.
const EXCERPT_COUNT: u64 = 10;
/// The samples that are added up at once.
const SHARD: u64 = 1 << 18;
/// The shards that one thread reads one after the other, so that it seldom reads samples only for the state that they leave behind.
const IN_A_ROW: u64 = 4;
/// The memory of a thread, bytes: samples, the derivatives of their errors and unpacked pages. Measured: below 20 MB.
const OF_THREAD: u64 = 32 << 20;
/// The memory of the excerpts and their fit, bytes. Measured: 160 MB.
const OF_EXCERPTS: u64 = 192 << 20;
/// Relative difference of two sample times that count as the same.
const SAME_STEP: f64 = 1e-6;
/// The excerpts are not judged, so that the least share is kept.
const LEAST_FRESH: f64 = 0.05;

/// The settings of an identification in parts.
pub struct Streamed<'a> {
    /// The column of the input.
    pub input: &'a str,
    /// The column of the output.
    pub output: &'a str,
    /// The column of the sample instants, which are checked in the whole record.
    pub time: Option<&'a str>,
    /// How long a unit of the instants is, s.
    pub time_unit: f64,
    /// The sample time by the first rows or by the user, s, where it is known.
    pub sample_time: Option<f64>,
    /// The memory for the computation, bytes; at least [`LEAST_MEMORY`](Self::LEAST_MEMORY).
    pub memory: u64,
}

/// What was fitted of a record in parts.
#[derive(Debug, Clone, Copy)]
pub struct Fitted {
    /// The samples that were fitted, from the record's beginning.
    pub samples: usize,
    /// Those that showed order, delay and breakpoints.
    pub of_excerpts: usize,
}

impl Fitted {
    /// What each of the samples was used for.
    pub fn text(&self) -> String {
        let [samples, of_excerpts] = [self.samples, self.of_excerpts].map(grouped);
        format!("{samples} fitted, read in parts; order, delay and breakpoints from {of_excerpts} of them")
    }
}

impl Streamed<'_> {
    /// The memory for the excerpts and one thread, bytes.
    pub const LEAST_MEMORY: u64 = OF_EXCERPTS + OF_THREAD;

    /// Identifies the system from a Parquet file; also returns the end of its record, on a share of which the system is judged.
    ///
    /// First the file is checked. Then order, delay, breakpoints and the noise's colour come from excerpts: parts spread evenly over the
    /// record, and those around the least and the greatest input. Then all coefficients and the places of kinks take steps on all
    /// samples but the share that is kept for the verdict. `stage` is called with the name of the present stage.
    ///
    /// The result does not depend on the number of threads or on the memory.
    ///
    /// # Errors
    /// For samples that are missing, not finite, or not at uniform instants, with their row; as [`ShardedHammerstein::new`].
    pub fn identify(&self, path: &Path, task: &Task, stage: &dyn Fn(&str)) -> Result<(RecordFile, Identified)> {
        let HammersteinMethod::Refined(method) = task.options.hammerstein else {
            anyhow::bail!("only the refined method can read a record in parts");
        };
        let signals = ParquetParts::open(path, &[self.input, self.output])?;
        let located = |error| signals.locate(error);
        stage("checking the samples");
        let mut names = vec![self.input, self.output];
        names.extend(self.time);
        let timed = ParquetParts::open(path, &names)?;
        let rows = signals.rows();
        let kept = (task.options.fresh_share * rows.min(EXCERPT_SAMPLES) as f64).round() as u64;
        let fitted = rows.saturating_sub(kept);
        let survey = Survey::new((&timed, path), &names, (&runs(rows), self.at_once()), fitted)?;
        let end = timed.excerpt(rows.saturating_sub(EXCERPT_SAMPLES)..rows)?;
        stage("structure");
        let read = |range: &Range<u64>| Ok(signals.excerpt(range.clone())?.record);
        let excerpts: Vec<Record> = excerpts(fitted, &survey.extremes)
            .iter()
            .map(read)
            .collect::<Result<_>>()?;
        let of_excerpts = excerpts.iter().map(Record::len).sum();
        let method = RefinedHammerstein {
            fresh_share: LEAST_FRESH,
            ..method
        };
        let excerpts: Vec<&Record> = excerpts.iter().collect();
        let mut found = ShardedHammerstein::new(method, &excerpts, self.input, self.output).map_err(located)?;
        let mut step = 1;
        loop {
            stage(&format!("step {step}, all samples"));
            let sums = self.sums(&signals, &found.point(), fitted)?;
            if !found.advance(sums).map_err(located)? {
                break;
            }
            step += 1;
        }
        let inputs = [self.input];
        let records = [&end.record];
        let request = Request::new(&records, &inputs, self.output, task.options.clone());
        let result = found.identification(&request).map_err(located)?;
        let mut identified = task.identified(&end, &request, self.step(survey.step), result)?;
        identified.records = vec![survey.mark];
        identified.in_parts = Some(Fitted {
            samples: fitted as usize,
            of_excerpts,
        });
        Ok((end, identified))
    }

    /// The runs that are read at once: each takes the memory of a thread.
    fn at_once(&self) -> usize {
        let runs = self.memory.saturating_sub(OF_EXCERPTS) / OF_THREAD;
        usize::try_from(runs).unwrap_or(usize::MAX).max(1)
    }

    /// The sample time, s: of the whole record, where its first rows are not the same to a millionth.
    fn step(&self, whole: Option<f64>) -> Option<f64> {
        let whole = whole.map(|step| step * self.time_unit);
        match (self.sample_time, whole) {
            (Some(first), Some(whole)) if (whole / first - 1.0).abs() > SAME_STEP => Some(whole),
            (first, _) => first,
        }
    }

    /// The sums over the first `fitted` samples.
    fn sums(&self, signals: &ParquetParts, point: &ShardPoint, fitted: u64) -> Result<ShardSums> {
        let mut all = point.empty();
        for some in runs(fitted).chunks(self.at_once()) {
            for sums in batch(some, |rows| sums_over(signals, point, rows.clone(), fitted)) {
                all.merge(&sums?).map_err(|error| signals.locate(error))?;
            }
        }
        Ok(all)
    }
}

/// The rows that a thread reads one after the other.
fn runs(rows: u64) -> Vec<Range<u64>> {
    let length = SHARD * IN_A_ROW;
    (0..rows.div_ceil(length))
        .map(|k| k * length..rows.min((k + 1) * length))
        .collect()
}

/// The excerpts of the first `fitted` rows.
fn excerpts(fitted: u64, extremes: &[u64]) -> Vec<Range<u64>> {
    if fitted <= EXCERPT_SAMPLES {
        return std::iter::once(0..fitted).collect();
    }
    let size = EXCERPT_SAMPLES / EXCERPT_COUNT;
    let last = fitted - size;
    let mut found: Vec<Range<u64>> = (0..EXCERPT_COUNT)
        .map(|k| {
            let start = (u128::from(last) * u128::from(k) / u128::from(EXCERPT_COUNT - 1)) as u64;
            start..start + size
        })
        .collect();
    for row in extremes {
        if !found.iter().any(|range| range.contains(row)) {
            let start = row.saturating_sub(size / 2).min(last);
            found.push(start..start + size);
        }
    }
    found.sort_by_key(|range| range.start);
    // No sample counts twice.
    let mut apart: Vec<Range<u64>> = Vec::new();
    for range in found {
        match apart.last_mut() {
            Some(before) if range.start <= before.end => before.end = before.end.max(range.end),
            _ => apart.push(range),
        }
    }
    apart
}

/// The sums over some rows of a record of which `length` samples are fitted.
fn sums_over(
    signals: &ParquetParts,
    point: &ShardPoint,
    rows: Range<u64>,
    length: u64,
) -> flexure_io::Result<ShardSums> {
    let reach = point.reach() as u64;
    let [mut u, mut y] = [Vec::new(), Vec::new()];
    // The row of the first sample that is held, and that of the first one that is not yet added.
    let (mut first, mut next) = (rows.start.saturating_sub(reach), rows.start);
    let mut all = point.empty();
    signals.read_rows(first..rows.end, &mut |_, columns| {
        u.extend_from_slice(&columns[0]);
        y.extend_from_slice(&columns[1]);
        loop {
            let to = (next + SHARD).min(rows.end);
            let held = (to - first) as usize;
            if next == rows.end || u.len() < held {
                return Ok(());
            }
            let before = (next - first) as usize;
            all.push(point, &u[..held], &y[..held], first as usize, before, length as usize)
                .map_err(|error| signals.locate(error))?;
            let passed = held - (reach as usize).min(held);
            u.drain(..passed);
            y.drain(..passed);
            (first, next) = (first + passed as u64, to);
        }
    })?;
    Ok(all)
}
