//! What is to be done, and with which data.

use std::collections::BTreeMap;
use std::str::FromStr;

pub type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// The work that is timed.
pub type Call = Box<dyn Fn(&Data) -> Result<Outcome>>;

/// What a call returns.
pub struct Outcome {
    /// The estimates at the evaluation points.
    pub estimates: Vec<f64>,
    /// The parameter that was chosen from the data, as `h=0.1`.
    pub chosen: Option<String>,
}

impl From<Vec<f64>> for Outcome {
    fn from(estimates: Vec<f64>) -> Self {
        Outcome {
            estimates,
            chosen: None,
        }
    }
}

/// The parameters of the job.
pub struct Job(BTreeMap<String, String>);

impl Job {
    pub fn parse(arguments: impl Iterator<Item = String>) -> Result<Job> {
        let pair = |a: String| {
            a.split_once('=')
                .map(|(key, value)| (key.to_owned(), value.to_owned()))
                .ok_or(format!("expected key=value, got {a:?}"))
        };
        Ok(Job(arguments.map(pair).collect::<std::result::Result<_, _>>()?))
    }

    pub fn text(&self, key: &str) -> Result<&str> {
        let value = self.0.get(key).ok_or(format!("the job does not say {key}="))?;
        Ok(value)
    }

    pub fn number<T: FromStr>(&self, key: &str) -> Result<T> {
        let text = self.text(key)?;
        Ok(text.parse().map_err(|_| format!("{key}={text} is no such number"))?)
    }
}

/// The data: columns of one length.
pub struct Data {
    /// The coordinates of the points.
    pub x: Vec<Vec<f64>>,
    /// Their ordinates.
    pub y: Vec<f64>,
    /// The coordinates of the points of evaluation.
    pub at: Vec<Vec<f64>>,
}

impl Data {
    /// Reads `data=` (the columns of x, then y) and `grid=`, both of little-endian 64-bit numbers.
    pub fn read(job: &Job) -> Result<Data> {
        let dimension: usize = job.number("dimension")?;
        let mut x = columns(job.text("data")?, dimension + 1)?;
        let y = x.pop().ok_or("no columns")?;
        let at = columns(job.text("grid")?, dimension)?;
        Ok(Data { x, y, at })
    }

    /// The first `count` points.
    pub fn first(&self, count: usize) -> Data {
        let count = count.min(self.y.len());
        Data {
            x: self.x.iter().map(|column| column[..count].to_vec()).collect(),
            y: self.y[..count].to_vec(),
            at: self.at.clone(),
        }
    }

    /// The columns of x.
    pub fn columns(&self) -> Vec<&[f64]> {
        self.x.iter().map(Vec::as_slice).collect()
    }

    /// The coordinates of the points of evaluation.
    pub fn points(&self) -> Vec<&[f64]> {
        self.at.iter().map(Vec::as_slice).collect()
    }
}

fn columns(path: &str, count: usize) -> Result<Vec<Vec<f64>>> {
    let bytes = std::fs::read(path).map_err(|e| format!("{path}: {e}"))?;
    let (numbers, rest) = bytes.as_chunks::<8>();
    if numbers.is_empty() || !rest.is_empty() || numbers.len() % count != 0 {
        return Err(format!("{path} does not hold {count} columns of 64-bit numbers").into());
    }
    let column = |part: &[[u8; 8]]| part.iter().map(|b| f64::from_le_bytes(*b)).collect();
    Ok(numbers.chunks(numbers.len() / count).map(column).collect())
}
