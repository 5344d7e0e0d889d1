//! Several axes of one log, each alone.

use std::collections::HashSet;
use std::path::PathBuf;

use anyhow::Result;
use flexure_io::RecordFile;
use flexure_workbench::joints::{Axes, AxisLoad, IdentifiedAxis, MOST_AXES, NamedAxis, identify};

use super::Arguments;
use super::chain::AxesOfChain;
use super::log::{Columns, Names};
use crate::arguments::{self, Usage};
use crate::files::{write_text, wrote};
use crate::output::{print, print_result, this_command};
use crate::progress::measured;

/// What stands for the axis in the name of a column.
pub(super) const AXIS: &str = "{}";

/// The names of the axes.
#[derive(Debug, Clone)]
pub struct AxisNames(pub Vec<String>);

/// Names and ranges of numbers: `1..6`, `1,3`, `left,right`.
pub fn names(text: &str) -> Result<AxisNames, String> {
    let mut names = Vec::new();
    for part in text.split(',').map(str::trim) {
        match part.split_once("..") {
            Some((first, last)) => {
                let number = |text: &str| text.trim().parse::<usize>().ok();
                let (Some(first), Some(last)) = (number(first), number(last)) else {
                    return Err(format!("'{part}' is no range of whole numbers, as 1..6 is"));
                };
                if first > last || last - first >= MOST_AXES {
                    return Err(format!(
                        "a range begins with its smaller number and has at most {MOST_AXES} axes"
                    ));
                }
                names.extend((first..=last).map(|i| i.to_string()));
            }
            // The name becomes a part of the names of files.
            None if !part.is_empty() && part.chars().all(|c| c.is_alphanumeric() || "_-".contains(c)) => {
                names.push(part.to_owned());
            }
            None => return Err("an axis is a number, or a name of letters, digits, _ and -".to_owned()),
        }
    }
    let mut distinct = HashSet::new();
    if let Some(twice) = names.iter().find(|name| !distinct.insert(name.as_str())) {
        return Err(format!("axis {twice} is named twice"));
    }
    match names.len() {
        1..=MOST_AXES => Ok(AxisNames(names)),
        _ => Err(format!("there are at most {MOST_AXES} axes")),
    }
}

/// Identifies the axes, and writes what was asked for.
pub fn run(arguments: &Arguments) -> Result<()> {
    let given = arguments.names();
    given.check_patterns()?;
    let robot = arguments.chain.robot()?;
    let file = arguments.read(&arguments.record)?;
    let later = arguments.later_file()?;
    let chain = robot.map(|robot| AxesOfChain::new(robot, arguments.axis.as_ref(), &given, &file));
    let axes = arguments.axes(chain.as_ref())?;
    let names: Vec<String> = axes.iter().map(|axis| axis.name.clone()).collect();
    arguments.check_numbered(&names)?;
    let loads = |file: &RecordFile| match &chain {
        Some(chain) => Ok::<_, anyhow::Error>(Some(chain.loads(arguments, &given, file)?)),
        None => Ok(None),
    };
    let later_loads = later.as_ref().map(loads).transpose()?.flatten();
    let loads = loads(&file)?;
    let found = measured("identifying", |reported| {
        Axes::new(&file.name(), axes, |i, axis| {
            reported.at(i, names.len());
            let joint = chain.as_ref().map(|chain| chain.joint(&axis.name)).transpose()?;
            let load = |loads: &Option<Vec<AxisLoad>>| Some(loads.as_ref()?[joint?].clone());
            let columns = Names {
                prismatic: axis.prismatic,
                ..given.of_axis(&axis.name, &file)
            };
            arguments.identified(
                &file,
                columns,
                load(&loads),
                later.as_ref().map(|file| (file, load(&later_loads))),
            )
        })
    })?;
    // Everything is made before anything is written.
    let page = match &arguments.report {
        None => None,
        Some(path) => Some((path, found.html(Some(this_command()), None)?)),
    };
    let curves = found.curves()?;
    let named = curves.iter().map(|(axis, curves)| (Some((*axis).to_owned()), curves));
    let mut written: Vec<PathBuf> = arguments.write_curves(named)?;
    if let Some((path, html)) = page {
        write_text(path, &html)?;
        written.push(path.clone());
    }
    if arguments.json {
        let mut object = found.json();
        object["samples"] = file.record.len().into();
        object["written"] = written.iter().map(|path| path.display().to_string()).collect();
        return print(&object.to_string());
    }
    print_result(&found.summary(), wrote(&written))
}

impl Arguments {
    /// The axes to identify: those that are named, or all joints of the chain.
    fn axes(&self, chain: Option<&AxesOfChain>) -> Result<Vec<NamedAxis>, Usage> {
        let all = |chain: &AxesOfChain| chain.all();
        let named = self.axis.as_ref().map(|AxisNames(names)| names.clone());
        let names = named.or_else(|| chain.map(all)).unwrap_or_default();
        if let Some(chain) = chain {
            names.iter().try_for_each(|axis| chain.joint(axis).map(|_| ()))?;
        }
        let axis = |name: String| NamedAxis {
            prismatic: chain.map_or(self.prismatic, |chain| chain.prismatic(&name)),
            name,
        };
        Ok(names.into_iter().map(axis).collect())
    }

    /// What is found of the axis in these columns, with the load of its chain, here and in a later file.
    fn identified(
        &self,
        file: &RecordFile,
        names: Names,
        load: Option<AxisLoad>,
        later: Option<(&RecordFile, Option<AxisLoad>)>,
    ) -> Result<IdentifiedAxis> {
        let columns = Columns::new(file, &names)?;
        let mut log = columns.log(file, self)?;
        log.axes[0].load = load;
        let joint = identify(log, &self.settings(names.prismatic), file, arguments::option)?;
        let mut other = self.later(later.as_ref().map(|(file, _)| *file), &names)?;
        if let (Some(other), Some((_, load))) = (&mut other, later) {
            other.log.axes[0].load = load;
        }
        let trial = joint.try_out(self.position_loop(file, &names)?, other)?;
        let remark = names.at_motor.then(|| {
            let column = names.position.unwrap_or_default();
            format!("the log has no angle of its link: it is taken as a rigid axis at its motor, column '{column}'")
        });
        Ok(IdentifiedAxis { joint, trial, remark })
    }
}

impl Names {
    /// The column of an axis's position, or of its link's.
    pub(super) fn position_of(&self, axis: &str, file: &RecordFile) -> Option<String> {
        let own = self.of_axis(axis, file);
        own.position.or(own.link)
    }

    fn columns(&mut self) -> impl Iterator<Item = (&'static str, &mut String)> {
        let others = [
            ("position", &mut self.position),
            ("motor", &mut self.motor),
            ("link", &mut self.link),
            ("velocity", &mut self.velocity),
            ("reference", &mut self.reference),
        ];
        let others = others
            .into_iter()
            .filter_map(|(option, name)| Some((option, name.as_mut()?)));
        std::iter::once(("torque", &mut self.torque)).chain(others)
    }

    /// Refuses names that mean the same column for every axis.
    fn check_patterns(&self) -> Result<(), Usage> {
        let mut given = self.clone();
        match given.columns().find(|(_, name)| !name.contains(AXIS)) {
            None => Ok(()),
            Some((option, name)) => Err(Usage(format!(
                "--{option} {name}: with --axis or --chain, write {AXIS} where the name has the axis, as in --{option} {name}{AXIS}"
            ))),
        }
    }

    /// The columns of one axis; if the log has no angle of its link, it is a rigid axis at its motor.
    pub(super) fn of_axis(&self, axis: &str, file: &RecordFile) -> Names {
        let mut own = self.clone();
        for (_, name) in own.columns() {
            *name = name.replace(AXIS, axis);
        }
        if let (Some(motor), Some(link)) = (&own.motor, &own.link)
            && file.has(motor)
            && !file.has(link)
        {
            (own.position, own.motor, own.link) = (own.motor.take(), None, None);
            own.at_motor = true;
        }
        own
    }
}
