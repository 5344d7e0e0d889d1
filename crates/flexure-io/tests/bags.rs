//! ROS 2 bags against files that rosbags and mcap wrote, and what rosbags reads of them (`scripts/reference/bag_fixtures.py`).

mod common;

use std::collections::BTreeMap;
use std::path::Path;

use common::{directory, fixture, message};
use flexure_io::{Error, ReadOptions, RecordFile};
use serde_json::Value;

fn read(path: impl AsRef<Path>, topic: Option<&str>, joint: Option<&str>) -> Result<RecordFile, Error> {
    let options = ReadOptions {
        topic: topic.map(str::to_owned),
        joint: joint.map(str::to_owned),
        ..ReadOptions::default()
    };
    options.read(path)
}

fn refused(path: impl AsRef<Path>, topic: Option<&str>, joint: Option<&str>) -> String {
    let error = read(&path, topic, joint).unwrap_err();
    message(&error, path.as_ref().parent().unwrap())
}

fn bits(samples: &[f64]) -> Vec<String> {
    samples.iter().map(|v| format!("{:016x}", v.to_bits())).collect()
}

/// What rosbags reads: by topic and column.
fn reference() -> BTreeMap<String, BTreeMap<String, Value>> {
    let text = std::fs::read_to_string(fixture("bags/bags.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

/// The files with the same messages.
const SAME: [&str; 9] = [
    "plain.mcap",
    "zstd.mcap",
    "lz4.mcap",
    "loose.mcap",
    "big_endian.mcap",
    "plain.db3",
    "messages.db3",
    "file.db3.zstd",
    "old.db3",
];

#[test]
fn every_number_is_that_of_rosbags_to_the_bit() {
    let reference = reference();
    for name in SAME {
        for (topic, columns) in &reference {
            // Files of old have no definitions, and this type is nobody's.
            if topic == "/talk" || (name == "old.db3" && topic == "/probe") {
                continue;
            }
            let file = read(fixture(&format!("bags/{name}")), Some(topic), None).unwrap();
            for (column, expected) in columns.iter().filter(|(column, _)| *column != "stamp") {
                let found = bits(file.record.column(column).unwrap());
                assert_eq!(serde_json::json!(found), *expected, "{name} {topic} {column}");
            }
            let extra = columns.contains_key("stamp");
            assert_eq!(
                file.record.names().len(),
                columns.len() + usize::from(!extra),
                "{name} {topic}"
            );
        }
    }
}

#[test]
fn stamps_are_those_of_the_header_in_seconds_from_the_first() {
    let stamps: Vec<i64> = serde_json::from_value(reference()["/probe"]["stamp"].clone()).unwrap();
    for name in SAME.into_iter().filter(|name| *name != "old.db3") {
        let file = read(fixture(&format!("bags/{name}")), Some("/probe"), None).unwrap();
        let expected: Vec<f64> = stamps.iter().map(|s| (s - stamps[0]) as f64 / 1e9).collect();
        assert_eq!(bits(file.finite("t").unwrap()), bits(&expected), "{name}");
        assert_eq!(file.unit("t"), Some("s"));
        let instants = file.instants_in_seconds(None).unwrap().unwrap();
        assert_eq!(instants.origin, Some(stamps[0]));
    }
    let file = read(fixture("bags/plain.mcap"), Some("/force"), None).unwrap();
    let logged: Vec<f64> = (0..40).map(|k| f64::from(k) * 1e7 / 1e9).collect();
    assert_eq!(file.finite("t").unwrap(), logged);
    assert_eq!(
        file.notes,
        ["t is when the messages were logged, as they have no stamps"]
    );
}

#[test]
fn a_joint_has_its_columns_and_names_its_topic() {
    let reference = &reference()["/joint_states"];
    for name in SAME {
        let file = read(fixture(&format!("bags/{name}")), None, Some("elbow")).unwrap();
        assert_eq!(file.record.names(), ["t", "position", "velocity", "effort"]);
        for kind in ["position", "velocity", "effort"] {
            let found = serde_json::json!(bits(file.finite(kind).unwrap()));
            assert_eq!(found, reference[&format!("elbow.{kind}")], "{name}");
        }
        assert_eq!(file.notes, ["topic /joint_states is read"]);
    }
    let path = fixture("bags/plain.mcap");
    let finger = read(&path, None, Some("finger")).unwrap();
    let directory = path.parent().unwrap();
    assert_eq!(
        message(&finger.finite("effort").unwrap_err(), directory),
        "plain.mcap: 'effort' cannot serve as a signal: it is empty in all messages"
    );
    assert_eq!(
        refused(&path, Some("/gripper"), Some("elbow"))
            .split(';')
            .next()
            .unwrap(),
        "plain.mcap: topic /gripper has no joint 'elbow'"
    );
    assert_eq!(
        refused(&path, Some("/force"), Some("elbow")),
        "plain.mcap cannot be read as a ROS 2 bag: topic /force: --joint is for sensor_msgs/msg/JointState, but its type is \
         std_msgs/msg/Float64"
    );
}

#[test]
fn what_is_no_number_is_named() {
    let path = fixture("bags/lz4.mcap");
    let file = read(&path, Some("/probe"), None).unwrap();
    let folder = path.parent().unwrap();
    for (column, what) in [
        ("note", "text"),
        ("image", "bytes"),
        (
            "wide",
            "a column of integers beyond 2^53, which cannot be represented exactly",
        ),
    ] {
        let expected = format!("lz4.mcap: '{column}' cannot serve as a signal: it is {what}");
        assert_eq!(message(&file.finite(column).unwrap_err(), folder), expected);
    }
}

#[test]
fn several_topics_are_listed_and_none_is_guessed() {
    let all = "/force (std_msgs/msg/Float64, 40 messages); /gripper (sensor_msgs/msg/JointState, 20 messages, joints finger); \
               /joint_states (sensor_msgs/msg/JointState, 40 messages, joints shoulder, elbow, wrist_3); /probe (own_msgs/msg/Probe, 40 \
               messages); /silent (std_msgs/msg/Float64, 0 messages); /talk (std_msgs/msg/String, 1 message, not read: its messages have no \
               numbers)";
    for name in ["plain.mcap", "plain.db3"] {
        let path = fixture(&format!("bags/{name}"));
        assert_eq!(
            refused(&path, None, None),
            format!("{name}: choose a topic by --topic; the topics are: {all}")
        );
        let none = format!("{name}: there is no topic '/x'; the topics are: {all}");
        assert_eq!(refused(&path, Some("/x"), None), none);
        let none = format!("{name}: no topic has a joint 'knee'; the topics are: {all}");
        assert_eq!(refused(&path, None, Some("knee")), none);
        let silent = format!("{name}: topic /silent has no messages; the topics are: {all}");
        assert_eq!(refused(&path, Some("/silent"), None), silent);
    }
    let lacking = "old.db3 cannot be read as a ROS 2 bag: topic /probe: its definition is not in the bag";
    assert_eq!(refused(fixture("bags/old.db3"), Some("/probe"), None), lacking);
    assert_eq!(
        refused(fixture("bags/empty.mcap"), None, None),
        "empty.mcap: no topic has messages of numbers; the topics are: none"
    );
    assert_eq!(
        refused(fixture("signals.mat"), Some("/x"), None),
        "signals.mat is no ROS 2 bag; leave out --topic and --joint"
    );
}

#[test]
fn what_a_channel_says_of_its_messages_is_held_against_them() {
    let odd = |name: &str| refused(fixture(&format!("bags/{name}")), Some("/pair"), None);
    let begin = "cannot be read as a ROS 2 bag: topic /pair:";
    for (name, what) in [
        ("surplus.mcap", "has 8 bytes more than its definition"),
        (
            "two_definitions.mcap",
            "has a different definition or encoding from the earlier messages of its topic",
        ),
        (
            "two_encodings.mcap",
            "has a different definition or encoding from the earlier messages of its topic",
        ),
    ] {
        let found = odd(name);
        let place = found.strip_prefix(&format!("{name} {begin} the message at byte "));
        assert!(place.is_some_and(|rest| rest.ends_with(&format!(" {what}"))), "{found}");
    }
    assert_eq!(
        odd("other_language.mcap"),
        format!(
            "other_language.mcap {begin} its definition is in the language 'ros2idl', but only ros2msg can be read"
        )
    );
    let flipped = odd("flipped.mcap");
    assert!(
        flipped.starts_with("flipped.mcap cannot be read as MCAP: the checksum of all data differs at byte "),
        "{flipped}"
    );
}

#[test]
fn a_column_that_is_computed_takes_no_more_than_the_limit() {
    let path = directory("computed_bag").join("gen.db3");
    let _ = std::fs::remove_file(&path);
    let database = rusqlite::Connection::open(&path).unwrap();
    let tables = "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
        INSERT INTO topics VALUES(1, '/force', 'std_msgs/msg/Float64', 'cdr');
        CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER,
            data BLOB GENERATED ALWAYS AS (zeroblob(900000000)));
        INSERT INTO messages(topic_id, timestamp) VALUES(1, 0), (1, 10);";
    database.execute_batch(tables).unwrap();
    drop(database);
    let options = ReadOptions {
        memory: Some(10 << 20),
        ..ReadOptions::default()
    };
    let refused = message(&options.read(&path).unwrap_err(), path.parent().unwrap());
    assert!(refused.contains("too big"), "{refused}");
}

#[test]
fn a_number_called_t_stands_beside_the_time() {
    let file = read(fixture("bags/named_t.mcap"), None, None).unwrap();
    assert_eq!(file.record.names(), ["t", "x", "y", "message.t"]);
    assert_eq!(file.record.column("message.t").unwrap(), [7.0; 30]);
    assert_eq!(file.record.column("t").unwrap()[3], 0.03);
}

#[test]
fn the_folder_of_a_bag_is_its_file() {
    let folder = directory("bag_folder");
    let files = ["a_0.mcap", "a_1.mcap"].map(|name| folder.join(name));
    let _ = std::fs::remove_file(&files[1]);
    std::fs::write(folder.join("metadata.yaml"), "").unwrap();
    std::fs::copy(fixture("bags/plain.mcap"), &files[0]).unwrap();
    let file = read(&folder, Some("/force"), None).unwrap();
    assert_eq!(file.path, files[0]);
    assert_eq!(file.notes[0], "the only bag of the folder is read");
    assert_eq!(file.record, read(&files[0], Some("/force"), None).unwrap().record);
    std::fs::copy(&files[0], &files[1]).unwrap();
    assert_eq!(
        refused(&folder, Some("/force"), None),
        "bag_folder cannot be read as a ROS 2 bag: the folder has several files of bags (a_0.mcap, a_1.mcap); give one of them"
    );
}

#[test]
fn a_bad_message_is_refused_with_its_topic_and_place() {
    assert_eq!(
        refused(fixture("bags/short.mcap"), Some("/joint_states"), None),
        "short.mcap cannot be read as a ROS 2 bag: topic /joint_states: the message at byte 3591 of the chunk at byte 36 ends too early"
    );
    // Another topic of the same bag is whole.
    assert!(read(fixture("bags/short.mcap"), Some("/probe"), None).is_ok());
    assert_eq!(
        refused(fixture("bags/truncated.mcap"), Some("/joint_states"), None),
        "truncated.mcap is truncated: it ends within the record that begins at byte 7770, after a message of topic /joint_states; `mcap recover` saves what is there; copy or save it again"
    );
    let folder = directory("bad_bags");
    let path = folder.join("cut.db3");
    let whole = std::fs::read(fixture("bags/plain.db3")).unwrap();
    std::fs::write(&path, &whole[..20_000]).unwrap();
    assert_eq!(
        refused(&path, Some("/force"), None),
        "cut.db3 is truncated: it ends at byte 20000 of 45056, so that none of its topics can be told; `sqlite3 FILE .recover` saves what is \
         there; copy or save it again"
    );
    // A page of messages that is overwritten.
    let mut changed = whole;
    let at = changed.windows(8).rposition(|w| w == b"shoulder").unwrap() / 4096 * 4096;
    changed[at..at + 4096].fill(0xff);
    std::fs::write(&path, changed).unwrap();
    let said = refused(&path, Some("/joint_states"), None);
    assert!(
        said.contains("topic /joint_states, after the message at row ") && said.contains("malformed"),
        "{said}"
    );
    let bytes = std::fs::read(fixture("bags/loose.mcap")).unwrap();
    let path = folder.join("changed.mcap");
    // The first message of the joints: its encapsulation becomes that of XCDR2.
    let name = b"shoulder";
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap();
    // Before it come the header of 4 bytes, the stamp of 8, an empty text of 8, a count and a length of 4 each.
    let header = at - 28;
    assert_eq!(bytes[header..header + 4], [0, 1, 0, 0]);
    let mut changed = bytes.clone();
    changed[header + 1] = 7;
    std::fs::write(&path, changed).unwrap();
    assert!(
        refused(&path, Some("/joint_states"), None)
            .ends_with("is encoded as 0x0007; plain CDR, 0x0000 and 0x0001, is read"),
        "{}",
        refused(&path, Some("/joint_states"), None)
    );
}

#[test]
fn a_damaged_chunk_and_a_cut_at_any_byte_are_refused() {
    let folder = directory("damaged_bags");
    let path = folder.join("b.mcap");
    let bytes = std::fs::read(fixture("bags/zstd.mcap")).unwrap();
    for length in (8..bytes.len()).step_by(97) {
        std::fs::write(&path, &bytes[..length]).unwrap();
        assert!(read(&path, Some("/force"), None).is_err(), "{length}");
    }
    let plain = std::fs::read(fixture("bags/big_endian.mcap")).unwrap();
    let at = plain.windows(8).position(|w| w == b"shoulder").unwrap();
    let mut changed = plain.clone();
    changed[at] ^= 1;
    std::fs::write(&path, changed).unwrap();
    assert!(refused(&path, Some("/force"), None).contains("the chunk is damaged: its checksum differs at byte"));
}

#[test]
fn a_bag_that_does_not_begin_as_one_or_whose_packing_ends_early_says_so() {
    let folder = directory("no_bags");
    for (name, bytes, said) in [
        ("b.mcap", &b"\x89MCAP"[..], "does not begin as one"),
        ("b.db3", b"SQLite", "cannot be read as SQLite: it does not begin as one"),
    ] {
        std::fs::write(folder.join(name), bytes).unwrap();
        let message = refused(folder.join(name), None, None);
        assert!(message.contains(said), "{message}");
    }
    let packed = std::fs::read(fixture("bags/file.db3.zstd")).unwrap();
    let path = folder.join("b.db3.zstd");
    for length in [20, packed.len() / 2, packed.len() - 1] {
        std::fs::write(&path, &packed[..length]).unwrap();
        let message = refused(&path, Some("/force"), None);
        assert!(message.contains("b.db3.zstd is truncated: "), "{length}: {message}");
    }
}

#[test]
fn what_a_bag_claims_is_asked_for_first() {
    let folder = directory("claiming_bags");
    let path = folder.join("claim.mcap");
    let mut bytes = b"\x89MCAP0\r\n".to_vec();
    bytes.push(6);
    bytes.extend((1_u64 << 40).to_le_bytes());
    std::fs::write(&path, bytes).unwrap();
    let error = read(&path, Some("/x"), None).unwrap_err();
    assert!(matches!(error, Error::TooLarge { .. }), "{error}");
    let options = ReadOptions {
        topic: Some("/joint_states".to_owned()),
        memory: Some(1000),
        ..ReadOptions::default()
    };
    for name in ["zstd.mcap", "plain.db3"] {
        let error = options.read(fixture(&format!("bags/{name}"))).unwrap_err();
        assert!(matches!(error, Error::TooLarge { .. }), "{error}");
    }
}

#[test]
fn a_wal_beside_a_database_is_not_passed_over() {
    let folder = directory("bag_wal");
    let path = folder.join("a b#1.db3");
    std::fs::copy(fixture("bags/plain.db3"), &path).unwrap();
    assert!(read(&path, Some("/force"), None).is_ok());
    std::fs::write(folder.join("a b#1.db3-wal"), "x").unwrap();
    assert!(refused(&path, Some("/force"), None).contains("next to it has messages that are not in it yet"));
}
