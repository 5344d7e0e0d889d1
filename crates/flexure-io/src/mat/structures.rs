//! Structures, whose fields are taken as variables.

use std::collections::HashMap;

use flexure::text::list;

use super::{Content, Cursor, Fault, MI_INT32, MI_MATRIX, Parsed, Variable, matrix};

/// The fields of a structure, behind its name: the length of a field's name with its padding, the names, and the arrays in their order.
pub(super) fn fields(cursor: &mut Cursor<'_>) -> Parsed<Vec<Variable>> {
    let (kind, bytes) = cursor.element()?;
    let (MI_INT32, &[l0, l1, l2, l3]) = (kind, bytes) else {
        return Err(Fault::Corrupt("a length of field names of a wrong kind"));
    };
    let length = cursor.u32_of([l0, l1, l2, l3]) as usize;
    let (_, names) = cursor.element()?;
    if length == 0 || !names.len().is_multiple_of(length) {
        return Err(Fault::Corrupt("field names that do not fit their length"));
    }
    let mut fields = Vec::new();
    for name in names.chunks_exact(length) {
        let name = name.split(|byte| *byte == 0).next().unwrap_or_default();
        let name = String::from_utf8(name.to_vec()).map_err(|_| Fault::Corrupt("a name that is not text"))?;
        let (MI_MATRIX, bytes) = cursor.element()? else {
            return Err(Fault::Corrupt("a field that is no array"));
        };
        let array = Cursor { bytes, ..*cursor };
        let content = match bytes.is_empty() {
            true => Content::Other("empty".to_owned()),
            false => matrix(array, true)?.content,
        };
        fields.push(Variable { name, content });
    }
    match cursor.bytes.is_empty() {
        true => Ok(fields),
        false => Err(Fault::Corrupt("bytes after the end of an array")),
    }
}

/// The variables with the fields of structures in place of these, and a sentence on them. A field has its own name, or `structure.field` if
/// there is another variable of that name. A field that has not as many samples as the signals is none.
pub(super) fn opened(variables: Vec<Variable>) -> (Vec<Variable>, Option<String>) {
    let samples = samples(&variables);
    let mut sharing: HashMap<String, usize> = HashMap::new();
    for name in variables.iter().flat_map(names) {
        *sharing.entry(name.to_owned()).or_default() += 1;
    }
    let (mut opened, mut structures) = (Vec::new(), Vec::new());
    for Variable { name, content } in variables {
        let Content::Structure(fields) = content else {
            opened.push(Variable { name, content });
            continue;
        };
        structures.push(format!("'{name}'"));
        for field in fields {
            let content = match field.content {
                Content::Vector(values) if Some(values.len()) != samples => Content::Other(format!(
                    "a vector of {}, where the signals have {}",
                    values.len(),
                    samples.unwrap_or(0)
                )),
                content => content,
            };
            let name = match sharing.get(&field.name) {
                Some(1) => field.name,
                _ => format!("{name}.{}", field.name),
            };
            opened.push(Variable { name, content });
        }
    }
    let are = if structures.len() == 1 {
        "structure"
    } else {
        "structures"
    };
    let note = format!("the fields of the {are} {} are read as variables", list(&structures));
    let note = Some(note).filter(|_| !structures.is_empty());
    (opened, note)
}

/// The number of samples of the signals: that of the first vector, or of the longest one in a structure if there are no others.
fn samples(variables: &[Variable]) -> Option<usize> {
    let length = |variable: &Variable| match &variable.content {
        Content::Vector(values) => Some(values.len()),
        _ => None,
    };
    let own = variables.iter().find_map(length);
    own.or_else(|| variables.iter().flat_map(fields_of).filter_map(length).max())
}

fn fields_of(variable: &Variable) -> &[Variable] {
    match &variable.content {
        Content::Structure(fields) => fields,
        _ => &[],
    }
}

/// The names of a variable that is none of a structure, or those of its fields.
fn names(variable: &Variable) -> Vec<&str> {
    match &variable.content {
        Content::Structure(fields) => fields.iter().map(|field| field.name.as_str()).collect(),
        _ => vec![&variable.name],
    }
}
