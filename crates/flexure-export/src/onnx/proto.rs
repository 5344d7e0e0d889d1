//! The few messages of ONNX that a graph needs, on protobuf's wire (onnx.proto3, IR version 8).

/// A message that is being written.
#[derive(Default, Clone)]
pub struct Message(pub Vec<u8>);

impl Message {
    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.0.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }

    /// A whole number.
    pub fn number(mut self, field: u64, value: i64) -> Self {
        self.varint(field << 3);
        self.varint(value as u64);
        self
    }

    /// Bytes, text or a message inside.
    pub fn bytes(mut self, field: u64, bytes: impl AsRef<[u8]>) -> Self {
        self.varint(field << 3 | 2);
        self.varint(bytes.as_ref().len() as u64);
        self.0.extend(bytes.as_ref());
        self
    }

    /// Several of one field.
    pub fn all<T: AsRef<[u8]>>(self, field: u64, each: impl IntoIterator<Item = T>) -> Self {
        each.into_iter()
            .fold(self, |message, bytes| message.bytes(field, bytes))
    }
}

impl AsRef<[u8]> for Message {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}

/// The types of tensors that are used, with their numbers in ONNX.
#[derive(Clone, Copy, PartialEq)]
pub enum Type {
    Int64 = 7,
    Bool = 9,
    Double = 11,
}

/// A dimension: a number or a name.
pub enum Dimension<'a> {
    Fixed(usize),
    Named(&'a str),
}

/// A constant.
pub fn tensor(name: &str, kind: Type, dimensions: &[usize], raw: &[u8]) -> Message {
    let sizes = dimensions
        .iter()
        .fold(Message::default(), |m, d| m.number(1, *d as i64));
    sizes.number(2, kind as i64).bytes(8, name).bytes(9, raw)
}

/// An input or an output.
pub fn value(name: &str, kind: Type, dimensions: &[Dimension<'_>]) -> Message {
    let dimension = |d: &Dimension<'_>| match d {
        Dimension::Fixed(size) => Message::default().number(1, *size as i64),
        Dimension::Named(name) => Message::default().bytes(2, name),
    };
    let shape = Message::default().all(1, dimensions.iter().map(dimension));
    let of_tensor = Message::default().number(1, kind as i64).bytes(2, shape);
    let of_value = Message::default().bytes(1, of_tensor);
    Message::default().bytes(1, name).bytes(2, of_value)
}

/// An attribute that is a whole number.
pub fn whole(name: &str, value: i64) -> Message {
    Message::default().bytes(1, name).number(3, value).number(20, 2)
}

/// An attribute that is a graph.
pub fn body(graph: &Message) -> Message {
    Message::default().bytes(1, "body").bytes(6, graph).number(20, 5)
}

/// An operation.
pub fn node(operation: &str, inputs: &[&str], outputs: &[&str], attributes: &[Message]) -> Message {
    let ends = Message::default().all(1, inputs).all(2, outputs);
    ends.bytes(4, operation).all(5, attributes)
}
