//! `flexure simulate` of chains: URDF, chain files and presets.

mod common;

use common::Folder;

const PENDULUM: &str = r#"<robot name="pendulum">
<link name="world"/>
<link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.001"/></inertial></link>
<joint name="pivot" type="continuous"><parent link="world"/><child link="rod"/><axis xyz="0 1 0"/></joint>
</robot>"#;

#[test]
fn a_urdf_swings_under_gravity_and_turns_under_torques() {
    let folder = Folder::new();
    folder.write("rod.urdf", PENDULUM);
    let run = "simulate rod.urdf --duration 2 --sample-time 0.01";
    let said = folder.done(&format!("{run} --start pivot=0.01 -o r.csv"));
    assert_eq!(
        said.trim(),
        "wrote r.csv (201 samples of 1 joint on a fixed base: pivot)"
    );
    // A small swing: m g c / (I + m c^2).
    let w = (2.0 * 9.81 * 0.5 / 0.6f64).sqrt();
    let angles = folder.column("r.csv", "q_pivot");
    for (k, angle) in angles.iter().enumerate() {
        assert!(
            (angle - 0.01 * (w * 0.01 * k as f64).cos()).abs() < 1e-6,
            "{k}: {angle}"
        );
    }
    // A constant torque without gravity: tau t^2 / 2 J.
    let rows = "0.3\n".repeat(201);
    folder.write("tau.csv", format!("tau_pivot\n{rows}"));
    let object = folder.json(&format!("{run} --no-gravity --torques tau.csv -o t.parquet"));
    assert_eq!(
        (&object["samples"], &object["joints"]),
        (&201.into(), &serde_json::json!(["pivot"]))
    );
    let last = *folder.column("t.parquet", "q_pivot").last().unwrap();
    assert!((last - 0.5 * 0.3 * 4.0 / 0.6).abs() < 1e-9, "{last}");
}

#[test]
fn presets_and_chain_files_run() {
    let folder = Folder::new();
    folder.done("simulate --preset space-manipulator --duration 3 --sample-time 0.5 --start joint2=0.3 -o m.csv");
    assert_eq!(folder.column("m.csv", "base_qw"), [1.0; 7]);
    folder.write(
        "arm.toml",
        "[chain]\ngravity = [0.0, 0.0, 0.0]\n[[chain.link]]\nname = \"arm\"\njoint = \"shoulder\"\nmass = 2.0\ncom = [0.5, 0.0, 0.0]\n\
         inertia = [0.01, 0.1, 0.1, 0.0, 0.0, 0.0]\n[chain.link.drive]\nmodel = \"linear\"\nmotor_inertia = 0.4\nstiffness = 300.0\n",
    );
    folder.done("simulate arm.toml --duration 1 --sample-time 0.5 --start shoulder=0.2 -o a.csv");
    // Link and motor start together.
    assert_eq!(folder.column("a.csv", "qm_shoulder"), [0.2; 3]);
}

#[test]
fn a_beam_of_segments_runs_and_has_torques_of_its_joint_alone() {
    let folder = Folder::new();
    folder.write(
        "beam.toml",
        "[chain]\ngravity = [0.0, 0.0, 0.0]\n[[chain.link]]\nname = \"arm\"\njoint = \"shoulder\"\nmass = 1.0\n\
         inertia = [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]\n[chain.link.beam]\nlength = 2.0\nstiffness = 300.0\ndensity = 0.7\n",
    );
    let rows = "1.0\n".repeat(11);
    folder.write("tau.csv", format!("tau_shoulder\n{rows}"));
    folder.done("simulate beam.toml --duration 0.1 --sample-time 0.01 --torques tau.csv -o b.csv");
    // The hub goes first and bends the root back.
    let (hub, root) = (
        folder.column("b.csv", "q_shoulder"),
        folder.column("b.csv", "q_arm_bend1"),
    );
    assert!(hub[10] > 0.0 && root[10] < 0.0, "{hub:?} {root:?}");
    let outcome = folder.run("simulate beam.toml --duration 0.1 --sample-time 0.01 --start arm_bend9=1 -o c.csv");
    assert!(
        outcome.stderr.contains("the joints are shoulder, arm_bend1, arm_bend2"),
        "{outcome:?}"
    );
}

/// The same beam by finite elements and by modes.
#[test]
fn beams_of_elements_and_modes_run_and_agree() {
    let folder = Folder::new();
    let text = "[chain]\n[[chain.link]]\nname = \"arm\"\njoint = \"shoulder\"\nmass = 1.0\n\
         inertia = [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]\n[chain.link.beam]\nlength = 2.0\nstiffness = 300.0\ndensity = 0.7\n";
    let rows = "1.0\n".repeat(21);
    folder.write("tau.csv", format!("tau_shoulder\n{rows}"));
    let tips: Vec<f64> = ["elements", "modes"]
        .into_iter()
        .map(|model| {
            folder.write("arm.toml", format!("{text}model = \"{model}\"\n"));
            folder.done(
                "simulate arm.toml --duration 0.2 --sample-time 0.01 --torques tau.csv --start shoulder=0.1 -o b.csv",
            );
            assert_eq!(folder.column("b.csv", "q_shoulder")[0], 0.1);
            folder.column("b.csv", "tip_arm")[20]
        })
        .collect();
    assert!(tips[0] < -1e-4 && (tips[1] / tips[0] - 1.0).abs() < 1e-2, "{tips:?}");
}

/// The page carries the points of every instant: a pendulum's end lies on its circle, and a free base drifts.
#[test]
fn a_page_shows_the_moving_chain() {
    let folder = Folder::new();
    folder.write("rod.urdf", PENDULUM);
    let run = "--duration 1 --sample-time 0.1 -o r.csv --report r.html";
    let said = folder.done(&format!("simulate rod.urdf {run} --start pivot=0.5"));
    assert!(said.ends_with("on a fixed base: pivot)\nwrote r.html\n"), "{said}");
    let drawn = |page: &str| -> serde_json::Value {
        let data = page.split("id=\"page-data\">").nth(1).unwrap();
        serde_json::from_str(data.split("</script>").next().unwrap()).unwrap()
    };
    let page = folder.read("r.html");
    assert!(page.contains("<title>Motion of rod.urdf</title>") && page.contains("flexure simulate rod.urdf"));
    let chain = &drawn(&page)["chain"];
    assert_eq!(chain["lines"], serde_json::json!([[0, 1], [1, 2]]));
    let angles = folder.column("r.csv", "q_pivot");
    for (k, angle) in angles.iter().enumerate() {
        // Along z at zero, turning about y.
        let end: Vec<f64> = (0..3).map(|c| chain["points"][k][2][c].as_f64().unwrap()).collect();
        let expected = [-0.5 * angle.sin(), 0.0, -0.5 * angle.cos()];
        assert!(
            end.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6),
            "{k}: {end:?} {expected:?}"
        );
    }
    // Under torques a free base moves, and its drift is a fact of the page.
    let rows = "3.0,-1.0\n".repeat(11);
    folder.write("tau.csv", format!("tau_joint1,tau_joint2\n{rows}"));
    folder.done(
        "simulate --preset free-space-arm --duration 1 --sample-time 0.1 --torques tau.csv -o f.csv --report f.html",
    );
    let page = folder.read("f.html");
    let [x, y] = ["base_x", "base_y"].map(|name| folder.column("f.csv", name));
    let moved = drawn(&page)["chain"]["points"][10][0][0].as_f64().unwrap();
    assert!(
        (moved - x[10]).abs() < 1e-6 && x[10].hypot(y[10]) > 1e-4,
        "{moved} {x:?}"
    );
    assert!(page.contains("Base drift"));
}

/// In a lift that accelerates upwards a pendulum swings faster; on a base that is turned it falls along another axis.
#[test]
fn a_base_is_moved_along_a_record() {
    let folder = Folder::new();
    folder.write("rod.urdf", PENDULUM);
    let lift: String = (0..101)
        .map(|k| format!("{}\n", 0.5 * 3.0 * (0.01 * f64::from(k)).powi(2)))
        .collect();
    folder.write("lift.csv", format!("base_z\n{lift}"));
    let run = "simulate rod.urdf --duration 1 --sample-time 0.01 --start pivot=0.01";
    let said = folder.done(&format!("{run} --base-motion lift.csv -o r.csv --report r.html"));
    assert!(said.contains("1 joint on a moving base: pivot"), "{said}");
    let w = (2.0 * (9.81 + 3.0) * 0.5 / 0.6f64).sqrt();
    let angles = folder.column("r.csv", "q_pivot");
    for (k, angle) in angles.iter().enumerate() {
        let expected = 0.01 * (w * 0.01 * k as f64).cos();
        assert!((angle - expected).abs() < 1e-6, "{k}: {angle}");
    }
    assert!((folder.column("r.csv", "base_vz")[100] - 3.0).abs() < 1e-9);
    let page = folder.read("r.html");
    assert!(page.contains("1 joint on a moving base") && page.contains("as is that of the base"));
    let turned = "0.3,1.5707963267948966,0.7\n".repeat(101);
    folder.write("turned.csv", format!("base_roll,base_pitch,base_yaw\n{turned}"));
    folder.done(&format!("{run} --base-motion turned.csv -o t.csv"));
    // With a pitch of 90 degrees gravity is along the base's x, whatever roll and yaw are.
    let fallen = folder.column("t.csv", "q_pivot")[10];
    let pull = -2.0 * 9.81 * 0.5 / 0.6;
    assert!((fallen - (0.01 + 0.5 * pull * 0.01)).abs() < 1e-3, "{fallen}");
    // The record itself is the motion of a base.
    folder.done(&format!("{run} --base-motion t.csv -o u.csv"));
    let (first, again) = (folder.column("t.csv", "q_pivot"), folder.column("u.csv", "q_pivot"));
    assert!(first.iter().zip(&again).all(|(a, b)| (a - b).abs() < 1e-9));
}

#[test]
fn what_cannot_be_run_is_refused() {
    let folder = Folder::new();
    folder.write("rod.urdf", PENDULUM);
    folder.write("bad.urdf", PENDULUM.replace("child link=\"rod\"", "child link=\"bar\""));
    folder.write("tau.csv", "tau_pivot\n1\n2\n");
    folder.write("other.csv", "u\n1\n2\n");
    folder.write("two.csv", "base_x\n1\n2\n");
    folder.write("twice.csv", "base_yaw,base_qw\n0,1\n0,1\n");
    let still = "simulate --preset space-manipulator --duration 1 --sample-time 0.1 -o r.csv";
    let run = "simulate rod.urdf --duration 1 --sample-time 0.1 -o r.csv";
    for (arguments, message) in [
        ("simulate rod.urdf -o r.csv", "is simulated for --duration seconds"),
        (
            "simulate bad.urdf --duration 1 --sample-time 0.1 -o r.csv",
            "bad.urdf, line 5:",
        ),
        (
            "simulate rod.urdf --duration 1 --sample-time 0 -o r.csv",
            "expected a positive number",
        ),
        (
            "simulate --preset six-joint-arm --free-base --duration 1 --sample-time 0.1 -o r.csv",
            "--free-base is for URDF",
        ),
        (
            "simulate --preset space-arm --duration 1 -o r.csv",
            "--duration is for chains",
        ),
        (
            "simulate --preset space-arm -o r.csv --report r.html",
            "--report draws chains",
        ),
        (
            &format!("{run} --start elbow=1"),
            "names the joint 'elbow'; the joints are pivot",
        ),
        (&format!("{run} --start pivot"), "needs JOINT=VALUE"),
        (
            &format!("{run} --torques tau.csv"),
            "there are 2 rows, but the run has 11 instants",
        ),
        (
            &format!("{run} --torques other.csv"),
            "no column is the torque of a joint; they are called tau_pivot",
        ),
        (
            &format!("{run} --base-motion two.csv"),
            "there are 2 rows, but the run has 11 instants",
        ),
        (
            &format!("{run} --base-motion twice.csv"),
            "the base's orientation is given twice",
        ),
        (
            &format!("{run} --base-motion other.csv"),
            "no column is the motion of a base; they are called base_x",
        ),
        (
            &format!("{still} --base-motion two.csv"),
            "cannot move a base that floats",
        ),
        (
            &format!("{run} --free-base --base-motion two.csv"),
            "cannot be used with",
        ),
    ] {
        let outcome = folder.run(arguments);
        assert!(
            outcome.code != Some(0) && outcome.stderr.contains(message),
            "{arguments}: {outcome:?}"
        );
        assert!(!folder.path("r.csv").exists(), "{arguments}");
    }
}
