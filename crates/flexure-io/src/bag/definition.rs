//! The definitions of messages, as ROS 2 writes them into bags.
//!
//! Source: "About ROS 2 interfaces", docs.ros.org; the text of a message and those of its parts, joined as in "MCAP: Well-known schema
//! encodings" (`ros2msg`).

use std::collections::HashMap;

use super::cdr::Decoded;

/// Definitions that bags need not have: `.db3` files had none before ROS 2 Iron.
const KNOWN: &str = include_str!("known.msg");

/// A number or a text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Basic {
    Bool,
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
    Text,
}

/// The kind of one value of a field.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Kind {
    Basic(Basic),
    /// The message of this name: `std_msgs/Header`.
    Message(String),
}

/// How many values a field holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Count {
    One,
    Fixed(usize),
    Any,
}

/// A field of a message.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) count: Count,
}

/// The definition of a message, with those of its parts.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Definition {
    pub(super) fields: Vec<Field>,
    parts: HashMap<String, Vec<Field>>,
}

/// The name of a type without `msg/` in it: `sensor_msgs/JointState`.
pub(super) fn short(name: &str) -> String {
    match name.split('/').collect::<Vec<_>>()[..] {
        [package, "msg", name] => format!("{package}/{name}"),
        _ => name.to_owned(),
    }
}

impl Definition {
    /// The definition of the type `name`, from its text if there is one, or from the known definitions.
    ///
    /// # Errors
    /// What is wrong; it completes the sentence "its definition ...".
    pub(super) fn new(name: &str, text: Option<&str>) -> Decoded<Self> {
        let name = short(name);
        let mut parts = parsed("", KNOWN)?;
        if let Some(text) = text {
            parts.extend(parsed(&name, text)?);
        }
        let Some(fields) = parts.get(&name).filter(|_| !name.is_empty()).cloned() else {
            return Err("is not in the bag".into());
        };
        let definition = Definition { fields, parts };
        definition.check(&definition.fields, 0)?;
        Ok(definition)
    }

    /// The fields of a part.
    pub(super) fn part(&self, name: &str) -> &[Field] {
        self.parts.get(name).map_or(&[], Vec::as_slice)
    }

    /// Whether the message agrees with the known definition of this name.
    pub(super) fn is_known(&self, name: &str) -> bool {
        let known = parsed("", KNOWN).unwrap_or_default();
        known.get(name) == Some(&self.fields)
            && [HEADER, TIME]
                .iter()
                .all(|part| known.get(*part).map(Vec::as_slice) == Some(self.part(part)))
    }

    /// Whether messages can have numbers: those of texts, images and clouds of points have none.
    pub(super) fn has_numbers(&self, fields: &[Field]) -> bool {
        fields.iter().any(|field| match &field.kind {
            Kind::Message(name) => name != HEADER && self.has_numbers(self.part(name)),
            Kind::Basic(Basic::Text) => false,
            Kind::Basic(Basic::U8) => field.count == Count::One,
            Kind::Basic(_) => true,
        })
    }

    /// Whether all parts are there; none has itself as a part.
    fn check(&self, fields: &[Field], depth: usize) -> Decoded<()> {
        /// More than any message nests: convention.
        const DEEPEST: usize = 16;
        if depth > DEEPEST {
            return Err("nests too deeply".into());
        }
        let mut seen: Vec<&str> = Vec::new();
        for field in fields {
            if let Kind::Message(name) = &field.kind
                && !seen.contains(&name.as_str())
            {
                seen.push(name);
                let part = self.parts.get(name);
                self.check(part.ok_or_else(|| format!("lacks that of {name}"))?, depth + 1)?;
            }
        }
        Ok(())
    }
}

pub(super) const HEADER: &str = "std_msgs/Header";
const TIME: &str = "builtin_interfaces/Time";

/// All definitions of a text by their names; the first is that of `name`.
fn parsed(name: &str, text: &str) -> Decoded<HashMap<String, Vec<Field>>> {
    let mut all = HashMap::new();
    let mut current = name.to_owned();
    let mut fields = Vec::new();
    for line in text.lines() {
        let line = line.trim();
        if line.starts_with("====") {
            continue;
        }
        if let Some(next) = line.strip_prefix("MSG:") {
            all.entry(current).or_insert(fields);
            (current, fields) = (short(next.trim()), Vec::new());
            continue;
        }
        fields.extend(field(line, &current)?);
    }
    all.entry(current).or_insert(fields);
    Ok(all)
}

/// The field of a line; `None` for a comment or a constant.
fn field(line: &str, within: &str) -> Decoded<Option<Field>> {
    let line = line.split('#').next().unwrap_or_default().trim();
    let Some((kind, rest)) = line.split_once(char::is_whitespace) else {
        return match line.is_empty() {
            true => Ok(None),
            false => Err(format!("has the line '{line}', which is no field").into()),
        };
    };
    let rest = rest.trim();
    let end = rest
        .find(|c: char| !(c.is_alphanumeric() || c == '_'))
        .unwrap_or(rest.len());
    let (name, behind) = rest.split_at(end);
    if behind.trim_start().starts_with('=') {
        return Ok(None);
    }
    let (kind, count) = match kind.strip_suffix(']').and_then(|kind| kind.split_once('[')) {
        None => (kind, Count::One),
        Some((kind, "")) => (kind, Count::Any),
        Some((kind, bound)) if bound.starts_with("<=") => (kind, Count::Any),
        Some((kind, count)) => {
            let count = count
                .parse()
                .map_err(|_| format!("has the line '{line}', whose length is no number"))?;
            (kind, Count::Fixed(count))
        }
    };
    // A text may have a bound.
    let kind = kind.split("<=").next().unwrap_or_default();
    let kind = match kind {
        "bool" => Kind::Basic(Basic::Bool),
        "int8" => Kind::Basic(Basic::I8),
        "uint8" | "byte" | "char" => Kind::Basic(Basic::U8),
        "int16" => Kind::Basic(Basic::I16),
        "uint16" => Kind::Basic(Basic::U16),
        "int32" => Kind::Basic(Basic::I32),
        "uint32" => Kind::Basic(Basic::U32),
        "int64" => Kind::Basic(Basic::I64),
        "uint64" => Kind::Basic(Basic::U64),
        "float32" => Kind::Basic(Basic::F32),
        "float64" => Kind::Basic(Basic::F64),
        "string" => Kind::Basic(Basic::Text),
        "wstring" | "float128" | "time" | "duration" => {
            return Err(format!("has a field of type {kind}, which is not read").into());
        }
        "Header" => Kind::Message(HEADER.to_owned()),
        part if part.contains('/') => Kind::Message(short(part)),
        part => {
            let package = within.split('/').next().unwrap_or_default();
            Kind::Message(format!("{package}/{part}"))
        }
    };
    let name = name.to_owned();
    Ok(Some(Field { name, kind, count }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_of_all_forms_and_no_constants() {
        let text = "# a comment\nint32 LIMIT=5\nuint8 A = 1\nfloat64[3] q # three\nstring<=5 name \"x\"\nPoint[<=2] p\nint8 d -1\n\
                    pkg/msg/Other[] o\n================\nMSG: own/Point\nfloat32 x 0.5\n================\nMSG: pkg/Other\nbool b\n";
        let definition = Definition::new("own/msg/All", Some(text)).unwrap();
        let field = |name: &str, kind, count| Field {
            name: name.to_owned(),
            kind,
            count,
        };
        let message = |name: &str| Kind::Message(name.to_owned());
        assert_eq!(
            definition.fields,
            [
                field("q", Kind::Basic(Basic::F64), Count::Fixed(3)),
                field("name", Kind::Basic(Basic::Text), Count::One),
                field("p", message("own/Point"), Count::Any),
                field("d", Kind::Basic(Basic::I8), Count::One),
                field("o", message("pkg/Other"), Count::Any),
            ]
        );
        assert_eq!(
            definition.part("own/Point"),
            [field("x", Kind::Basic(Basic::F32), Count::One)]
        );
    }

    #[test]
    fn what_cannot_be_read_is_said() {
        let problem = |text: &str| Definition::new("a/A", Some(text)).unwrap_err();
        assert_eq!(problem("B b"), "lacks that of a/B");
        assert_eq!(problem("A a"), "nests too deeply");
        assert_eq!(problem("wstring w"), "has a field of type wstring, which is not read");
        assert_eq!(
            problem("float64[x] q"),
            "has the line 'float64[x] q', whose length is no number"
        );
        assert_eq!(problem("float64"), "has the line 'float64', which is no field");
        assert_eq!(Definition::new("a/B", None).unwrap_err(), "is not in the bag");
    }

    #[test]
    fn all_that_is_known_is_whole() {
        let all = parsed("", KNOWN).unwrap();
        assert!(all.len() > 40);
        for name in all.keys().filter(|name| !name.is_empty()) {
            let definition = Definition::new(name, None).unwrap();
            assert!(definition.is_known(name), "{name}");
        }
    }
}
