//! The topics of a bag; a record is one of them.

/// A topic of a bag.
#[derive(Debug, Clone, PartialEq)]
pub struct Topic {
    /// Its name.
    pub name: String,
    /// The type of its messages: `sensor_msgs/msg/JointState`.
    pub kind: String,
    /// How many messages it has.
    pub messages: u64,
    /// The names of its joints, in the order of their first occurrence.
    pub joints: Vec<String>,
    /// Why it cannot be read; `None` if it can.
    pub problem: Option<String>,
}

impl std::fmt::Display for Topic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let count = flexure::text::counted(usize::try_from(self.messages).unwrap_or(usize::MAX), "message");
        let kind = if self.kind.is_empty() {
            "type not known"
        } else {
            &self.kind
        };
        write!(f, "{} ({kind}, {count}", self.name)?;
        match self.joints.is_empty() {
            true => {}
            false => write!(f, ", joints {}", flexure::text::list(&self.joints))?,
        }
        match &self.problem {
            None => write!(f, ")"),
            Some(problem) => write!(f, ", not read: {problem})"),
        }
    }
}
