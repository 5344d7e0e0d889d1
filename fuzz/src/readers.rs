//! The readers, in this process.

use std::path::{Path, PathBuf};

use std::ops::ControlFlow;

use anyhow::{Context as _, Result, ensure};
use flexure::Record;
use flexure::manipulator::chain::{ChainSimulation, DrivenChain, RotorCoupling, simulate_chain_watched};
use flexure::manipulator::flexible_arm::simulate_flexible_arm_watched;
use flexure::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts};
use flexure_export::{Fmi, Format, Options, export};
use flexure_io::arm::{ArmFile, ChainFile, PRESETS, SCENARIOS, Scenario, chain_file_of_toml, preset_text};
use flexure_io::urdf::{UrdfOptions, parse_urdf};
use flexure_io::{ParquetParts, ReadOptions, model_text, parse_model, write_record};
use flexure_workbench::export::exportable;
use rand_pcg::Pcg64;
use tempfile::TempDir;

use crate::mutation::changed;
use crate::{Target, commands, models};

/// Memory for one record.
const MEMORY: u64 = 64 << 20;

/// Texts as people and programs write them.
const TEXTS: [&str; 8] = [
    "t,u,y\n0,1,2\n0.1,3,4\n0.2,5,6\n",
    "Time [s];Torque (N m);q [deg]\n0,0;1,5;2,5\n0,1;1,6;2,75\n",
    "# a comment\n 1.0  2.0  3.0\n 1.1  2.1  3.1\n\n",
    "sep=;\nt;x\n2024-05-01T10:00:00.1;1\n2024-05-01T10:00:00.2;2\n",
    ",u,y\n0,1.5,2\n1,NA,nan\n2,,3\n",
    "\"a \"\"b\"\"\",c\n1,2\n3,\"4\"\n",
    "t\tu\ty\n0\t1e3\t-2.5e-3\n1\t2e3\t7\n",
    "1,250;2,125\n1,500;2,250\n",
];

/// A record's reader.
struct Records {
    name: &'static str,
    extension: &'static str,
    seeds: Vec<Vec<u8>>,
    /// Those of a bag, one after the other.
    topics: &'static [Option<&'static str>],
    folder: TempDir,
}

impl Target for Records {
    fn name(&self) -> &'static str {
        self.name
    }

    fn input(&self, random: &mut Pcg64) -> Vec<u8> {
        changed(random, &self.seeds)
    }

    fn check(&self, input: &[u8]) -> Result<()> {
        let path = self.folder.path().join("record").with_extension(self.extension);
        std::fs::write(&path, input)?;
        for topic in self.topics {
            self.read(&path, *topic)?;
        }
        Ok(())
    }
}

impl Records {
    fn read(&self, path: &Path, topic: Option<&str>) -> Result<()> {
        let options = ReadOptions {
            memory: Some(MEMORY),
            topic: topic.map(str::to_owned),
            ..ReadOptions::default()
        };
        match options.read(path) {
            Ok(file) => {
                let lengths = file.record.columns().map(|(_, samples)| samples.len());
                ensure!(
                    lengths.into_iter().all(|n| n == file.record.len()),
                    "columns of different lengths"
                );
                ensure!(
                    file.units.len() == file.record.names().len(),
                    "as many units as columns"
                );
                if self.extension == "parquet" {
                    let names: Vec<&str> = file.record.names().iter().map(String::as_str).collect();
                    let found = in_parts(path, &names).context("in parts")?;
                    ensure!(
                        bits(&found) == bits(&file.record),
                        "the parts have other samples than the whole"
                    );
                }
            }
            Err(error) => {
                ensure!(error.to_string().len() < 100_000, "the message is long");
                if self.extension == "parquet"
                    && let Err(error) = ParquetParts::head(path, 1000)
                {
                    ensure!(error.to_string().len() < 100_000, "the message of the parts is long");
                }
            }
        }
        Ok(())
    }
}

/// These columns of a Parquet file, part by part.
fn in_parts(path: &Path, names: &[&str]) -> Result<Record> {
    let parts = ParquetParts::open(path, names)?;
    let mut columns = vec![Vec::new(); names.len()];
    for part in 0..parts.count() {
        parts.read(part, &mut |_, some| {
            columns.iter_mut().zip(some).for_each(|(all, some)| all.extend(some));
            Ok(())
        })?;
    }
    Ok(Record::new(names.iter().copied().zip(columns))?)
}

fn bits(record: &Record) -> Vec<u64> {
    record
        .columns()
        .flat_map(|(_, samples)| samples.iter().map(|v| v.to_bits()))
        .collect()
}

/// An arm file.
struct Arms(Vec<Vec<u8>>);

impl Target for Arms {
    fn name(&self) -> &'static str {
        "arm"
    }

    fn input(&self, random: &mut Pcg64) -> Vec<u8> {
        changed(random, &self.0)
    }

    fn check(&self, input: &[u8]) -> Result<()> {
        let text = String::from_utf8_lossy(input);
        if let Ok(file) = ArmFile::from_toml_str(&text, "the arm")
            && let Ok(again) = file.to_toml()
        {
            // Compared as text: values that the model does not use may be NaN, which differs from itself.
            let read = ArmFile::from_toml_str(&again, "again")?;
            ensure!(read.to_toml()? == again, "it reads back as another arm");
        }
        Ok(())
    }
}

/// The description of a chain: a URDF or a chain file.
struct Chains {
    name: &'static str,
    seeds: Vec<Vec<u8>>,
    read: fn(&str) -> Result<ChainFile>,
}

impl Target for Chains {
    fn name(&self) -> &'static str {
        self.name
    }

    fn input(&self, random: &mut Pcg64) -> Vec<u8> {
        changed(random, &self.seeds)
    }

    fn check(&self, input: &[u8]) -> Result<()> {
        let chain = match (self.read)(&String::from_utf8_lossy(input)) {
            Ok(chain) => chain,
            Err(error) => {
                ensure!(error.to_string().len() < 100_000, "the message is long");
                return Ok(());
            }
        };
        // A chain that was read can be simulated, or the error says why not.
        let mut steps = 0;
        let mut few = |_| {
            steps += 1;
            match steps < 30 {
                true => ControlFlow::Continue(()),
                false => ControlFlow::Break(()),
            }
        };
        let record = match chain {
            ChainFile::Chain(chain) => {
                let options = ChainSimulation::new(&chain, 0.01, 0.001)?;
                simulate_chain_watched(&chain, &[], &options, &mut few)
            }
            ChainFile::FlexibleArm(arm) => {
                let options = ChainSimulation::from_state(vec![0.0; arm.dimension()], 0.01, 0.001)?;
                simulate_flexible_arm_watched(&arm, &[], &options, &mut few)
            }
        };
        if let Ok(record) = record {
            let mut values = record.columns().flat_map(|(_, samples)| samples);
            ensure!(values.all(|v| v.is_finite()), "the motion is not finite");
        }
        Ok(())
    }
}

fn urdf(text: &str) -> Result<ChainFile> {
    let chain = parse_urdf(text, Path::new("robot.urdf"), &UrdfOptions::default())?;
    Ok(ChainFile::Chain(DrivenChain::new(chain, &[], RotorCoupling::None)?))
}

/// A control scenario.
struct Scenarios(Vec<Vec<u8>>);

impl Target for Scenarios {
    fn name(&self) -> &'static str {
        "scenario"
    }

    fn input(&self, random: &mut Pcg64) -> Vec<u8> {
        changed(random, &self.0)
    }

    fn check(&self, input: &[u8]) -> Result<()> {
        let text = String::from_utf8_lossy(input);
        // The folder of arm files does not exist.
        if let Err(error) = Scenario::from_toml_str(&text, "the scenario", Path::new("nowhere")) {
            ensure!(error.to_string().len() < 100_000, "the message is long");
        }
        Ok(())
    }
}

/// A model file.
struct Models(Vec<Vec<u8>>);

impl Target for Models {
    fn name(&self) -> &'static str {
        "model"
    }

    fn input(&self, random: &mut Pcg64) -> Vec<u8> {
        changed(random, &self.0)
    }

    fn check(&self, input: &[u8]) -> Result<()> {
        let path = Path::new("model");
        if let Ok(model) = parse_model(input, path) {
            let text = model_text(&model, path)?;
            ensure!(
                parse_model(text.as_bytes(), path)? == model,
                "it reads back as another model"
            );
        }
        Ok(())
    }
}

/// The formats of exports.
const FORMATS: [Format; 5] = [Format::C, Format::Fmu, Format::Onnx, Format::Python, Format::Matlab];

/// A model file or the table of a curve, which is exported in all formats.
struct Exports {
    seeds: Vec<Vec<u8>>,
    folder: TempDir,
}

impl Target for Exports {
    fn name(&self) -> &'static str {
        "export"
    }

    fn input(&self, random: &mut Pcg64) -> Vec<u8> {
        changed(random, &self.seeds)
    }

    fn check(&self, input: &[u8]) -> Result<()> {
        let name = if input.starts_with(b"{") {
            "model.json"
        } else {
            "curve.csv"
        };
        let path = self.folder.path().join(name);
        std::fs::write(&path, input)?;
        let Ok(model) = exportable(&path) else {
            return Ok(());
        };
        for format in FORMATS {
            for fmi in [Fmi::Two, Fmi::Three] {
                let options = Options {
                    format,
                    name: Some("model"),
                    fmi,
                    compile: false,
                };
                let out = Path::new("model").with_extension(format.extension());
                let Ok(files) = export(&model, &out, options) else {
                    continue;
                };
                if format == Format::C {
                    files.iter().try_for_each(|file| finite(&file.bytes))?;
                }
            }
        }
        Ok(())
    }
}

/// All numbers of a program in C are finite.
fn finite(text: &[u8]) -> Result<()> {
    let text = std::str::from_utf8(text).context("the program is no UTF-8")?;
    // Comments say where a curve is NaN.
    let code = text.lines().map(|line| line.split("/*").next().unwrap_or_default());
    for word in code.flat_map(|line| line.split(|c: char| !(c.is_ascii_alphanumeric() || "._+-".contains(c)))) {
        let number = word.starts_with(|c: char| c.is_ascii_digit() || c == '-') || ["NaN", "inf"].contains(&word);
        ensure!(
            !number || word.parse::<f64>().map_or(true, f64::is_finite),
            "the program has the number {word}"
        );
    }
    Ok(())
}

/// All targets; `fixtures` has records that other programs wrote.
pub fn all(fixtures: &Path) -> Result<Vec<Box<dyn Target>>> {
    let folder = tempfile::tempdir()?;
    let made = folder.path().join("known.parquet");
    let [damped, _] = known_linear_parts();
    let known = KnownHammerstein::usual(KnownNonlinearity::DeadZone, damped).simulate(300, 1);
    write_record(&made, &known)?;
    let mut mat = Vec::new();
    let mut parquet = vec![std::fs::read(made)?];
    let mut paths: Vec<PathBuf> = Vec::new();
    for folder in [fixtures.to_owned(), fixtures.join("bags"), fixtures.join("hdf5")] {
        paths.extend(std::fs::read_dir(folder)?.flatten().map(|e| e.path()));
    }
    paths.sort();
    let [mut mcap, mut db3, mut hdf5] = [const { Vec::new() }; 3];
    for path in paths {
        match path.extension().and_then(|e| e.to_str()) {
            Some("mcap") => mcap.push(std::fs::read(path)?),
            Some("db3") => db3.push(std::fs::read(path)?),
            Some("h5") => hdf5.push(std::fs::read(path)?),
            Some("mat") => mat.push(std::fs::read(path)?),
            Some("parquet") => parquet.push(std::fs::read(path)?),
            _ => {}
        }
    }
    let text = TEXTS.iter().map(|text| text.as_bytes().to_vec()).collect();
    let mut targets: Vec<Box<dyn Target>> = Vec::new();
    let once: &[_] = &[None];
    let topics: &[_] = &[None, Some("/joint_states"), Some("/probe"), Some("/force")];
    for (name, extension, seeds, topics) in [
        ("text", "csv", text, once),
        ("mat", "mat", mat, once),
        ("parquet", "parquet", parquet, once),
        ("hdf5", "h5", hdf5, once),
        ("mcap", "mcap", mcap, topics),
        ("db3", "db3", db3, topics),
    ] {
        targets.push(Box::new(Records {
            name,
            extension,
            seeds,
            topics,
            folder: tempfile::tempdir()?,
        }));
    }
    let arms = PRESETS
        .iter()
        .map(|(name, _)| Ok(preset_text(name)?.as_bytes().to_vec()));
    targets.push(Box::new(Arms(arms.collect::<Result<_>>()?)));
    let chains = [
        &include_bytes!("chain.toml")[..],
        include_bytes!("../../docs/examples/flexible-arm.toml"),
    ];
    for (name, seeds, read) in [
        (
            "urdf",
            &[&include_bytes!("robot.urdf")[..]][..],
            urdf as fn(&str) -> Result<ChainFile>,
        ),
        ("chain", &chains, |text| Ok(chain_file_of_toml(text, "the chain")?)),
    ] {
        let seeds = seeds.iter().map(|seed| seed.to_vec()).collect();
        targets.push(Box::new(Chains { name, seeds, read }));
    }
    let scenarios = SCENARIOS.iter().chain(&commands::SCENARIOS);
    let scenarios = scenarios.map(|(_, text)| text.as_bytes().to_vec());
    targets.push(Box::new(Scenarios(scenarios.collect())));
    let mut models = model_seeds()?;
    targets.push(Box::new(Models(models.clone())));
    models.extend([
        b"q,tau\n-1,-0.5\n0,0\n2,1.5\n".to_vec(),
        b"x,y,lower,upper\n0,1,0,2\n1,3,2,4\n".to_vec(),
    ]);
    targets.push(Box::new(Exports {
        seeds: models,
        folder: tempfile::tempdir()?,
    }));
    Ok(targets)
}

/// Model files of all kinds of blocks; one has everything that an identification adds.
pub fn model_seeds() -> Result<Vec<Vec<u8>>> {
    let mut seeds = vec![include_bytes!("model.json").to_vec()];
    for (_, model) in models::models() {
        seeds.push(model_text(&model, Path::new("model"))?.into_bytes());
    }
    Ok(seeds)
}
