//! An arm file with other values, its comments kept.

use serde_json::Value as Json;
use toml_edit::{Array, DocumentMut, InlineTable, Item, TableLike, TomlError, Value};

use super::error::ArmError;

/// The tables that are replaced as a whole, since one kind of excitation refuses the keys of another.
const WHOLE: [&str; 2] = ["excitation", "noise"];

/// The text of an arm file with other values, an object as JSON: `{"run": {"duration": 20}, "arm": {"joint": [{"locked": true}, {}]}}`.
///
/// A table changes in the keys that are given. The excitation and the noise change as a whole. A key whose value is null is taken out.
/// Comments stay, except those of replaced values.
///
/// # Errors
/// [`ArmError`] for a text that is no TOML, and for changes that are no table of tables or do not fit the text's.
pub fn with_changes(text: &str, changes: &str) -> Result<String, ArmError> {
    let changes: Json = serde_json::from_str(changes).map_err(|error| wrong(error.to_string()))?;
    let mut document: DocumentMut = text.parse().map_err(|error: TomlError| wrong(error.to_string()))?;
    let Json::Object(changes) = changes else {
        return Err(wrong("the changes of an arm are a table".to_owned()));
    };
    for (name, change) in changes {
        if WHOLE.contains(&name.as_str()) {
            document.remove(&name);
        }
        put(document.as_table_mut(), &name, &change)?;
    }
    Ok(document.to_string())
}

fn wrong(message: String) -> ArmError {
    ArmError::Format {
        file: "the changed arm".to_owned(),
        line: None,
        message,
    }
}

/// Changes the value at a key.
fn put(table: &mut dyn TableLike, key: &str, change: &Json) -> Result<(), ArmError> {
    let unfit = |needs: &str| Err(wrong(format!("'{key}' is {needs}")));
    match change {
        Json::Null => {
            table.remove(key);
        }
        Json::Object(changes) => {
            let inner = table.entry(key).or_insert(toml_edit::table());
            let Some(inner) = inner.as_table_like_mut() else {
                return unfit("no table");
            };
            for (key, change) in changes {
                put(inner, key, change)?;
            }
        }
        Json::Array(changes) if table.get(key).is_some_and(Item::is_array_of_tables) => {
            let tables = table.get_mut(key).and_then(Item::as_array_of_tables_mut);
            let mut tables = tables.into_iter().flat_map(|tables| tables.iter_mut());
            for change in changes {
                let (Some(inner), Json::Object(changes)) = (tables.next(), change) else {
                    return unfit("a list of as many tables as the arm has");
                };
                for (key, change) in changes {
                    put(inner, key, change)?;
                }
            }
        }
        _ => {
            let mut value =
                value(change).ok_or_else(|| wrong(format!("'{key}' is {change}, which an arm file cannot have")))?;
            match table.get_mut(key).and_then(Item::as_value_mut) {
                Some(old) => {
                    *value.decor_mut() = old.decor().clone();
                    *old = value;
                }
                None => {
                    table.insert(key, Item::Value(value));
                }
            }
        }
    }
    Ok(())
}

/// The value in TOML; `None` if TOML has no such value.
fn value(json: &Json) -> Option<Value> {
    Some(match json {
        Json::Null => return None,
        Json::Bool(flag) => Value::from(*flag),
        Json::Number(number) => match number.as_i64() {
            Some(whole) => Value::from(whole),
            None => Value::from(number.as_f64()?),
        },
        Json::String(text) => Value::from(text.as_str()),
        Json::Array(items) => Value::Array(items.iter().map(value).collect::<Option<Array>>()?),
        Json::Object(items) => {
            let pairs = items.iter().map(|(key, item)| Some((key.clone(), value(item)?)));
            Value::InlineTable(pairs.collect::<Option<InlineTable>>()?)
        }
    })
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::super::{ArmFile, preset_text};
    use super::*;

    fn space_arm() -> &'static str {
        preset_text("space-arm").unwrap()
    }

    #[test]
    fn keys_change_and_everything_else_stays() {
        let changes = json!({
            "arm": {"model": "rigid", "joint": [{"locked": true, "friction": null}, {"motor_inertia": 2}]},
            "run": {"duration": 20, "sample_time": 0.002},
        });
        let text = with_changes(space_arm(), &changes.to_string()).unwrap();
        let [old, new] = [space_arm(), &text].map(|text| ArmFile::from_toml_str(text, "arm").unwrap());
        assert_eq!(
            (new.run.duration, new.run.sample_time, new.run.rtol),
            (20.0, 0.002, old.run.rtol)
        );
        assert_eq!(new.excitation, old.excitation);
        assert_eq!(new.arm.joints[1].motor_inertia, 2.0);
        assert!(
            text.contains("# A two-link space manipulator") && text.contains("duration = 20 "),
            "{text}"
        );
        let lines = |text: &str| text.lines().count();
        assert_eq!(lines(&text), lines(space_arm())); // a line more, a line less
    }

    #[test]
    fn an_excitation_and_a_noise_change_as_a_whole() {
        let changes = json!({
            "excitation": {"kind": "multisine", "amplitude": [4.0, 2.0], "f_min": 0.05, "f_max": 3.0},
            "noise": {"std": {"q1": 1e-4}},
        });
        let text = with_changes(space_arm(), &changes.to_string()).unwrap();
        let file = ArmFile::from_toml_str(&text, "arm").unwrap();
        assert!(!text.contains("distribution"), "{text}");
        assert_eq!(file.noise.unwrap().std["q1"], 1e-4);
        let quiet = with_changes(&text, r#"{"noise": null}"#).unwrap();
        assert_eq!(ArmFile::from_toml_str(&quiet, "arm").unwrap().noise, None);
    }

    #[test]
    fn nothing_changes_nothing() {
        assert_eq!(with_changes(space_arm(), "{}").unwrap(), space_arm());
    }

    #[test]
    fn what_does_not_fit_is_said() {
        let message = |changes: Json| with_changes(space_arm(), &changes.to_string()).unwrap_err().to_string();
        assert_eq!(
            message(json!([1])),
            "the changed arm: the changes of an arm are a table"
        );
        assert_eq!(
            message(json!({"run": {"duration": {"s": 1}}})),
            "the changed arm: 'duration' is no table"
        );
        let three = json!({"arm": {"joint": [{}, {}, {}]}});
        assert_eq!(
            message(three),
            "the changed arm: 'joint' is a list of as many tables as the arm has"
        );
        // Keys that TOML allows but an arm does not are refused by the arm's own check.
        let text = with_changes(space_arm(), r#"{"run": {"speed": 1}}"#).unwrap();
        assert!(
            ArmFile::from_toml_str(&text, "arm")
                .unwrap_err()
                .to_string()
                .contains("speed")
        );
    }
}
