//! Messages a second that are read from a bag: `cargo bench -p flexure-io --bench bags`.
//!
//! A million messages of `sensor_msgs/JointState` with six joints, and as many of `std_msgs/Float64`; plain and packed; the least time on
//! the processor of three runs. The topic is given; without it a bag is gone through twice.

use std::path::Path;

use flexure_io::ReadOptions;

const MESSAGES: u32 = 1_000_000;
const CHUNK: usize = 1 << 20;
const JOINTS: [&str; 6] = [
    "shoulder_pan",
    "shoulder_lift",
    "elbow",
    "wrist_1",
    "wrist_2",
    "wrist_3",
];

/// Bytes of a message, aligned as CDR has them.
#[derive(Default)]
struct Cdr(Vec<u8>);

impl Cdr {
    fn put<const N: usize>(&mut self, bytes: [u8; N]) {
        self.0.resize(self.0.len().next_multiple_of(N), 0);
        self.0.extend(bytes);
    }

    fn text(&mut self, text: &str) {
        self.put((text.len() as u32 + 1).to_le_bytes());
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }

    fn message(self) -> Vec<u8> {
        [vec![0, 1, 0, 0], self.0].concat()
    }
}

fn joint_state(k: u32) -> Vec<u8> {
    let mut cdr = Cdr::default();
    cdr.put((k / 1000).to_le_bytes());
    cdr.put((k % 1000 * 1_000_000).to_le_bytes());
    cdr.text("base_link");
    cdr.put((JOINTS.len() as u32).to_le_bytes());
    JOINTS.iter().for_each(|name| cdr.text(name));
    for kind in 0..3 {
        cdr.put((JOINTS.len() as u32).to_le_bytes());
        (0..JOINTS.len()).for_each(|i| cdr.put(f64::from(k * 18 + kind * 6 + i as u32).sin().to_le_bytes()));
    }
    cdr.message()
}

fn float(k: u32) -> Vec<u8> {
    let mut cdr = Cdr::default();
    cdr.put(f64::from(k).sin().to_le_bytes());
    cdr.message()
}

fn record(code: u8, content: &[u8]) -> Vec<u8> {
    [&[code][..], &(content.len() as u64).to_le_bytes(), content].concat()
}

fn text(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
}

/// An MCAP file of one topic.
fn mcap(path: &Path, kind: &str, packed: bool, message: fn(u32) -> Vec<u8>) {
    // The definition is known.
    let schema = [&1_u16.to_le_bytes()[..], &text(kind), &text(""), &text("")].concat();
    let channel = [
        &[1_u16.to_le_bytes(); 2].concat()[..],
        &text("/topic"),
        &text("cdr"),
        &text(""),
    ]
    .concat();
    let mut file = b"\x89MCAP0\r\n".to_vec();
    file.extend(record(3, &schema));
    file.extend(record(4, &channel));
    let mut records = Vec::new();
    for k in 0..MESSAGES {
        let instant = (u64::from(k) * 1_000_000).to_le_bytes();
        let content = [
            &1_u16.to_le_bytes()[..],
            &k.to_le_bytes(),
            &instant,
            &instant,
            &message(k),
        ]
        .concat();
        records.extend(record(5, &content));
        if records.len() > CHUNK || k == MESSAGES - 1 {
            let stored = match packed {
                true => zstd::bulk::compress(&records, 1).unwrap(),
                false => records.clone(),
            };
            let head = [&[0; 16][..], &(records.len() as u64).to_le_bytes(), &[0; 4]].concat();
            let name = text(if packed { "zstd" } else { "" });
            let chunk = [&head[..], &name, &(stored.len() as u64).to_le_bytes(), &stored].concat();
            file.extend(record(6, &chunk));
            records.clear();
        }
    }
    file.extend(record(2, &[0; 20]));
    file.extend(b"\x89MCAP0\r\n");
    std::fs::write(path, file).unwrap();
}

fn db3(path: &Path, kind: &str, message: fn(u32) -> Vec<u8>) {
    let mut database = rusqlite::Connection::open(path).unwrap();
    let tables = "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
        CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);
        CREATE INDEX timestamp_idx ON messages (timestamp ASC);";
    database.execute_batch(tables).unwrap();
    let all = database.transaction().unwrap();
    all.execute("INSERT INTO topics VALUES (1, '/topic', ?1, 'cdr')", [kind])
        .unwrap();
    {
        let mut insert = all.prepare("INSERT INTO messages VALUES (NULL, 1, ?1, ?2)").unwrap();
        for k in 0..MESSAGES {
            insert.execute((i64::from(k) * 1_000_000, message(k))).unwrap();
        }
    }
    all.commit().unwrap();
}

/// The time of this thread on the processor, which other programs do not change.
fn seconds() -> f64 {
    let schedule = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux says how long a thread ran");
    let nanoseconds: f64 = schedule.split(' ').next().and_then(|n| n.parse().ok()).unwrap();
    nanoseconds / 1e9
}

fn main() {
    let folder = tempfile::tempdir().unwrap();
    println!("messages                     file                MB   million a second");
    for (kind, message) in [
        ("sensor_msgs/msg/JointState", joint_state as fn(u32) -> Vec<u8>),
        ("std_msgs/msg/Float64", float),
    ] {
        for name in ["plain.mcap", "zstd.mcap", "plain.db3"] {
            let path = folder.path().join(name);
            match name {
                "plain.db3" => db3(&path, kind, message),
                _ => mcap(&path, kind, name == "zstd.mcap", message),
            }
            let options = ReadOptions {
                topic: Some("/topic".to_owned()),
                ..ReadOptions::default()
            };
            let time = |_| {
                let start = seconds();
                let file = options.read(&path).unwrap();
                assert_eq!(file.record.len(), MESSAGES as usize);
                seconds() - start
            };
            let least = (0..3).map(time).fold(f64::INFINITY, f64::min);
            let size = std::fs::metadata(&path).unwrap().len() as f64 / 1e6;
            println!(
                "{kind:<28} {name:<12} {size:>9.0} {:>18.2}",
                f64::from(MESSAGES) / least / 1e6
            );
            std::fs::remove_file(&path).unwrap();
        }
    }
}
