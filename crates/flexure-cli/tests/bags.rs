//! The topics of a bag on the command line: listed, chosen, identified.

mod common;

use common::Folder;

fn folder() -> Folder {
    let folder = Folder::new();
    for name in ["plain.mcap", "plain.db3"] {
        let path = format!("{}/../flexure-io/tests/data/bags/{name}", env!("CARGO_MANIFEST_DIR"));
        std::fs::copy(path, folder.path(name)).unwrap();
    }
    folder
}

#[test]
fn look_lists_topics_and_joints_and_the_command_that_it_ends_with_runs() {
    let folder = folder();
    let listed = folder.done("look plain.mcap");
    assert_eq!(
        listed.lines().collect::<Vec<_>>(),
        [
            "/force (std_msgs/msg/Float64, 40 messages)",
            "/gripper (sensor_msgs/msg/JointState, 20 messages, joints finger)",
            "/joint_states (sensor_msgs/msg/JointState, 40 messages, joints shoulder, elbow, wrist_3)",
            "/probe (own_msgs/msg/Probe, 40 messages)",
            "/silent (std_msgs/msg/Float64, 0 messages)",
            "/talk (std_msgs/msg/String, 1 message, not read: its messages have no numbers)",
            "",
            "next: flexure look plain.mcap --topic /gripper",
        ]
    );
    let looked = folder.done("look plain.mcap --topic /gripper");
    assert!(
        looked.starts_with("plain.mcap: 20 samples of 3 columns, every 0.02 s"),
        "{looked}"
    );
    let found = folder.json("look plain.db3");
    assert_eq!(
        found["topics"][2]["joints"],
        serde_json::json!(["shoulder", "elbow", "wrist_3"])
    );
    assert_eq!(found["topics"][5]["problem"], "its messages have no numbers");
    assert_eq!(found["next"]["command"], "flexure look plain.db3 --topic /gripper");
}

#[test]
fn a_topic_that_is_not_there_is_an_error_everywhere() {
    let folder = folder();
    let outcome = folder.run("look plain.mcap --topic /x");
    assert_eq!(outcome.code, Some(1));
    assert!(
        outcome
            .stderr
            .starts_with("error: plain.mcap: there is no topic '/x'; the topics are: /force"),
        "{outcome:?}"
    );
    folder.known("u.csv", 300, 1);
    folder.failed(
        "look u.csv --topic /x",
        "u.csv is no ROS 2 bag; leave out --topic and --joint",
    );
}

#[test]
fn a_joint_of_a_bag_needs_no_columns() {
    let folder = folder();
    let outcome = folder.run("joint plain.mcap --joint elbow");
    assert_eq!(outcome.code, Some(1));
    assert!(
        outcome.stderr.contains("needs at least 200 samples, but there are 40"),
        "{outcome:?}"
    );
    folder.failed(
        "joint plain.mcap --topic /gripper --joint finger",
        "plain.mcap: 'effort' cannot serve as a signal: it is empty in all messages",
    );
    let outcome = folder.run("joint plain.csv");
    assert_eq!(outcome.code, Some(2), "{outcome:?}");
}

#[test]
fn a_bag_becomes_a_table_with_the_same_numbers() {
    let folder = folder();
    for name in ["plain.mcap", "plain.db3"] {
        folder.done(&format!("prepare {name} --topic /joint_states --joint elbow --resample 0.01 --hold position,velocity,effort -o out.parquet"));
        let bytes = std::fs::read(folder.path("out.parquet")).unwrap();
        assert!(folder.column("out.parquet", "position").len() >= 39);
        if name == "plain.mcap" {
            folder.write("first.parquet", bytes);
        } else {
            assert_eq!(std::fs::read(folder.path("first.parquet")).unwrap(), bytes);
        }
    }
}
