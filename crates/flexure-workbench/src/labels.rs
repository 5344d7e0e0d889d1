//! Names of columns with their units, as pages write them at axes.

use std::collections::BTreeMap;

use flexure_io::RecordFile;

/// The units of a record's columns: from its file, or the units of the columns that Flexure's simulation writes.
#[derive(Debug, Clone, Default)]
pub struct Labels(BTreeMap<String, String>);

impl Labels {
    /// The units of a file's columns.
    pub fn new(file: &RecordFile) -> Self {
        let columns = file.record.names().iter().zip(&file.units);
        let known = columns.filter_map(|(name, unit)| Some((name.clone(), unit.clone()?)));
        Labels(known.collect())
    }

    /// The unit of a column; empty where it is not known.
    pub fn unit(&self, column: &str) -> &str {
        self.0
            .get(column)
            .map_or_else(|| simulated_unit(column), String::as_str)
    }

    /// The known units of these columns, by the columns' names.
    pub fn units<'a>(&self, columns: impl Iterator<Item = &'a String>) -> BTreeMap<String, String> {
        let known = columns.filter(|column| !self.unit(column).is_empty());
        known
            .map(|column| (column.clone(), self.unit(column).to_owned()))
            .collect()
    }

    /// A column's name with its unit in parentheses, where that is known.
    pub fn of(&self, column: &str) -> String {
        match self.unit(column) {
            "" => column.to_owned(),
            unit => format!("{column} ({unit})"),
        }
    }

    /// Several columns, one after the other.
    pub fn of_all(&self, columns: &[String]) -> String {
        columns
            .iter()
            .map(|column| self.of(column))
            .collect::<Vec<_>>()
            .join(", ")
    }
}

/// The unit of the columns that Flexure's simulation writes; empty for any other.
fn simulated_unit(column: &str) -> &'static str {
    match column {
        "tau1" | "tau2" => "N m",
        "q1" | "q2" | "qm1" | "qm2" | "d1" | "d2" => "rad",
        "dq1" | "dq2" | "dqm1" | "dqm2" => "rad/s",
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flexure::Record;

    #[test]
    fn a_files_unit_comes_before_that_of_the_name() {
        let record = Record::new(["u", "q1", "tau1", "x"].map(|name| (name, vec![0.0]))).unwrap();
        let mut file = RecordFile::in_memory(record, "r.csv");
        file.units = vec![Some("V".to_owned()), Some("deg".to_owned()), None, None];
        let labels = Labels::new(&file);
        assert_eq!(
            ["u", "q1", "tau1", "x"].map(|name| labels.of(name)),
            ["u (V)", "q1 (deg)", "tau1 (N m)", "x"]
        );
        assert_eq!(labels.of_all(&["u".to_owned(), "x".to_owned()]), "u (V), x");
    }
}
