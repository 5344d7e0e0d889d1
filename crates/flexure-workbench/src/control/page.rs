//! A scenario's outcome as the page that shows it.

use flexure::control::{Run, tip};
use flexure_report::data::{ArmMotion, Axis, ControlPage, Fact, Signal, Table, TipPathPlot};

use super::outcome::short;
use super::{Outcome, Row};

/// The most controllers whose paths are drawn: more than four lines cannot be distinguished.
const DRAWN: usize = 4;

impl Outcome {
    /// The page, for a scenario of this name.
    ///
    /// # Errors
    /// None for an outcome of [`compare`](super::compare).
    pub fn html(&self, scenario: &str, command: Option<String>) -> flexure_report::Result<String> {
        flexure_report::render_control(&self.page(scenario, command))
    }

    fn page(&self, scenario: &str, command: Option<String>) -> ControlPage {
        let (columns, rows) = self.cells();
        let best = self.best();
        let chosen = best.and_then(|best| self.rows.iter().position(|row| row.controller == best.controller));
        // The best first, then in the order of the scenario.
        let carried = self
            .rows
            .iter()
            .filter_map(|row| row.run.as_ref().map(|run| (row, run)));
        let mut shown: Vec<(&Row, &Run)> = carried.collect();
        shown.sort_by_key(|(row, _)| best.is_none_or(|best| best.controller != row.controller));
        shown.truncate(DRAWN);
        let mut signals: Vec<Signal> = shown.iter().map(|(row, run)| self.error(row, run)).collect();
        // Shaped references end later: all signals are as long as the shortest.
        let length = shown.iter().map(|(_, run)| run.t.len()).min().unwrap_or(0);
        if let Some((_, run)) = shown.first() {
            // A flexible link has one motor.
            let names: &[&str] = if self.is_arm() {
                &["torque 1", "torque 2"]
            } else {
                &["torque"]
            };
            signals.extend(names.iter().enumerate().map(|(j, name)| Signal {
                name: (*name).to_owned(),
                unit: "N m".to_owned(),
                values: run.torque.iter().map(|torque| torque[j]).collect(),
            }));
        }
        signals.iter_mut().for_each(|signal| signal.values.truncate(length));
        let count = self.rows.len();
        let what = if count == 1 {
            "One controller".to_owned()
        } else {
            format!("{count} controllers")
        };
        let runs = if self.seeds == 1 {
            "one run".to_owned()
        } else {
            format!("{} runs", self.seeds)
        };
        ControlPage {
            title: format!("Control of {}: {scenario}", self.body),
            subtitle: format!("{what} on one motion of {} s, {runs} of each.", short(self.end)),
            facts: best.map(|best| self.facts(best)).unwrap_or_default(),
            warnings: (self.rows.iter())
                .filter_map(|row| {
                    row.failure
                        .as_ref()
                        .map(|failure| format!("{}: {failure}.", row.controller))
                })
                .collect(),
            table: Table {
                title: "Controllers in one table".to_owned(),
                text: self.legend(),
                columns,
                rows,
                chosen,
                ends_in_text: false,
            },
            paths: self.paths(&shown),
            signals,
            time: Axis::of_samples(Some(self.sample_time), 0),
            arm: (shown.first())
                .filter(|_| self.is_arm())
                .map(|(row, run)| self.motion(row, run)),
            command,
        }
    }

    /// The tip's distance from its reference.
    fn error(&self, row: &Row, run: &Run) -> Signal {
        let distance = |k: usize| {
            let ([x, y], [rx, ry]) = (tip(&self.links, run.truth[k].q), tip(&self.links, run.reference[k]));
            1e3 * (x - rx).hypot(y - ry)
        };
        Signal {
            name: row.controller.clone(),
            unit: "mm".to_owned(),
            values: (0..run.t.len()).map(distance).collect(),
        }
    }

    /// The reference, and the tip's paths.
    fn paths(&self, shown: &[(&Row, &Run)]) -> Vec<TipPathPlot> {
        let path = |name: &str, places: Vec<[f64; 2]>| TipPathPlot {
            name: name.to_owned(),
            x: places.iter().map(|p| p[0]).collect(),
            y: places.iter().map(|p| p[1]).collect(),
        };
        let of = |q: &mut dyn Iterator<Item = [f64; 2]>| q.map(|q| tip(&self.links, q)).collect();
        let reference = shown
            .first()
            .map(|(_, run)| path("reference", of(&mut run.reference.iter().copied())));
        let runs = shown
            .iter()
            .map(|(row, run)| path(&row.controller, of(&mut run.truth.iter().map(|s| s.q))));
        reference.into_iter().chain(runs).collect()
    }

    fn motion(&self, row: &Row, run: &Run) -> ArmMotion {
        let pair = |of: &dyn Fn(usize) -> [f64; 2]| [0, 1].map(|j| (0..run.t.len()).map(|k| of(k)[j]).collect());
        ArmMotion {
            caption: format!("Seen from above the plane of motion, under {}.", row.controller),
            lengths: self.links.map(|link| link.length),
            time: Axis::of_samples(Some(self.sample_time), 0),
            q: pair(&|k| run.truth[k].q),
            qm: pair(&|k| run.truth[k].qm),
            tau: pair(&|k| run.torque[k]),
        }
    }

    /// A flexible link has no second link.
    fn is_arm(&self) -> bool {
        self.links[1].length > 0.0
    }

    fn facts(&self, best: &Row) -> Vec<Fact> {
        vec![
            Fact::new(
                "Smallest maximum error",
                format!("{} mm", short(1e3 * best.tip_error_max.median)),
                format!("of the tip, by {}", best.controller),
            ),
            Fact::new(
                "Its root mean square",
                format!("{} mm", short(1e3 * best.tip_error_rms.median)),
                "over motion and rest",
            ),
            Fact::new(
                "Its peak torque",
                format!("{} N m", short(best.torque_peak.median)),
                if self.is_arm() {
                    "of either motor"
                } else {
                    "of the motor"
                },
            ),
        ]
    }
}
