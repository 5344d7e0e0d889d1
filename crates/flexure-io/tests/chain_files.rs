//! Chain files say the chain that they describe, and bad ones are refused with line and key.

use flexure::manipulator::chain::{Base, ChainSimulation, simulate_chain};
use flexure_io::arm::{ChainFile, chain_file_of_toml, chain_of_toml, is_chain};

const GOOD: &str = r#"[chain]
base = "fixed"
gravity = [0.0, 0.0, 0.0]
[[chain.link]]
name = "upper"
joint = "shoulder"
mass = 1.5075
com = [2.25, 0.0, 0.0]
inertia = [0.01, 2.544, 2.544, 0.0, 0.0, 0.0]
limits = [-3.0, 3.0]
[chain.link.drive]
model = "linear"
motor_inertia = 1.0
stiffness = 500.0
[[chain.link]]
name = "lower"
joint = "elbow"
origin = [4.5, 0.0, 0.0]
mass = 1.5075
com = [2.25, 0.0, 0.0]
inertia = [0.01, 2.544, 2.544, 0.0, 0.0, 0.0]
"#;

#[test]
fn a_chain_file_is_the_chain() {
    assert!(is_chain(GOOD) && !is_chain("[arm]\nmodel = \"rigid\"\n"));
    let chain = chain_of_toml(GOOD, "arm.toml").unwrap();
    assert_eq!(chain.chain().joints(), ["shoulder", "elbow"]);
    assert_eq!((chain.flexible(), chain.dimension()), (vec![true, false], 6));
    // About the shoulder with the arm stretched: m1 c^2 + I1 + m2 (l + c)^2 + I2.
    let mut matrix = [0.0; 4];
    let mut data = chain.chain().data();
    chain.chain().mass_matrix(&mut data, &[0.0, 0.0], &mut matrix).unwrap();
    let want = 2.0 * 2.544 + 1.5075 * (2.25f64.powi(2) + 6.75f64.powi(2));
    assert!((matrix[0] - want).abs() < 1e-12 * want, "{matrix:?}");
    // With a load at the tip.
    let loaded = format!("{GOOD}[load]\nmass = 2.0\ncom = [4.5, 0.0, 0.0]\n");
    let loaded = chain_of_toml(&loaded, "arm.toml").unwrap();
    loaded.chain().mass_matrix(&mut data, &[0.0, 0.0], &mut matrix).unwrap();
    assert!((matrix[0] - want - 2.0 * 81.0).abs() < 1e-9, "{matrix:?}");
}

#[test]
fn a_free_base_has_a_body() {
    let free = GOOD.replace("base = \"fixed\"", "base = \"free\"").replace(
        "[[chain.link]]\nname = \"upper\"",
        "[chain.body]\nmass = 120.0\ninertia = [29.0, 29.0, 29.0, 0.0, 0.0, 0.0]\n[[chain.link]]\nname = \"upper\"",
    );
    let chain = chain_of_toml(&free, "arm.toml").unwrap();
    assert_eq!(chain.chain().base(), Base::Free);
    let options = ChainSimulation::new(&chain, 2.0, 0.1).unwrap();
    let push = vec![5.0; 21];
    let record = simulate_chain(&chain, &[&push, &[0.0; 21]], &options).unwrap();
    // The base turns back where the shoulder is pushed forward.
    assert!(record.column("q_shoulder").unwrap()[20] > 0.0 && record.column("base_qz").unwrap()[20] < 0.0);
}

/// Two beams as segments, with a load where the tip is: 2 joints, 3 springs each by default, 4 in the second.
#[test]
fn links_are_beams_of_segments_and_what_they_carry_sits_at_their_tips() {
    let lower = GOOD.find("[[chain.link]]\nname = \"lower\"").unwrap();
    let beam = "[chain.link.beam]\nlength = 4.5\nstiffness = 5000.0\ndensity = 0.335\n";
    let text = format!(
        "{}{beam}{}{beam}damping = 0.01\nsprings = \"middle\"\ncount = 4\n[load]\nmass = 2.0\n",
        &GOOD[..lower],
        GOOD[lower..].replace("origin = [4.5, 0.0, 0.0]\n", "")
    );
    let chain = chain_of_toml(&text, "arm.toml").unwrap();
    assert_eq!(chain.driven(), ["shoulder", "elbow"]);
    let joints = chain.chain().joints();
    assert_eq!(
        (joints.len(), joints[1].as_str(), joints[8].as_str()),
        (9, "upper_bend1", "lower_bend4")
    );
    // Straight, about the shoulder: hubs, rods and load.
    let mut matrix = [0.0; 81];
    chain
        .chain()
        .mass_matrix(&mut chain.chain().data(), &[0.0; 9], &mut matrix)
        .unwrap();
    let hubs = 2.0 * 2.544 + 1.5075 * (2.25f64.powi(2) + 6.75f64.powi(2));
    let want = hubs + 0.335 * 9.0f64.powi(3) / 3.0 + 2.0 * 81.0;
    assert!((matrix[0] - want).abs() < 1e-11 * want, "{} {want}", matrix[0]);
    for (good, bad, message) in [
        (
            "density = 0.335",
            "density = 0.0",
            "arm.toml, line 4: chain.link[1]: link 'upper': the density of its beam",
        ),
        (
            "density = 0.335",
            "densty = 0.335",
            "arm.toml, line 18: unknown field `densty`",
        ),
        (
            "count = 4",
            "axes = [[1.0, 0.0, 0.0]]",
            "link 'lower': its beam needs a direction and one or two axes",
        ),
        (
            "count = 4",
            "axes = [[1.0, 0.0]]",
            "there must be 3 numbers in this list, but it has 2",
        ),
        ("\"middle\"", "\"tip\"", "unknown variant `tip`"),
        (
            "motor_inertia = 1.0",
            "motor_inertia = 0.0",
            "arm.toml, line 13: chain.link[1].drive.motor_inertia: ",
        ),
    ] {
        assert!(text.contains(good), "{good}");
        let refused = chain_of_toml(&text.replacen(good, bad, 1), "arm.toml")
            .unwrap_err()
            .to_string();
        assert!(refused.contains(message), "{good} -> {bad}: {refused}");
    }
}

/// The same file with another model of its beams is a flexible arm of the same inertia.
#[test]
fn beams_of_elements_and_modes_make_a_flexible_arm() {
    let beam = "[chain.link.beam]\nlength = 4.5\nstiffness = 5000.0\ndensity = 0.335\n";
    let lower = GOOD.find("[[chain.link]]\nname = \"lower\"").unwrap();
    let text = format!(
        "{}{beam}model = \"elements\"\n{}{beam}model = \"modes\"\ncount = 2\naxial_stiffness = 1e6\n[load]\nmass = 2.0\n",
        &GOOD[..lower],
        &GOOD[lower..]
    );
    let ChainFile::FlexibleArm(arm) = chain_file_of_toml(&text, "arm.toml").unwrap() else {
        panic!("a chain");
    };
    // Two joints, five elements, two stretches and two modes; the first joint has a motor.
    assert_eq!((arm.coordinates(), arm.motors()), (2 + 10 + 4, 1));
    let mass = arm.mass_matrix(&[0.0; 16]).unwrap()[0];
    let hubs = 2.0 * 2.544 + 1.5075 * (2.25f64.powi(2) + 6.75f64.powi(2));
    let want = hubs + 0.335 * 9.0f64.powi(3) / 3.0 + 2.0 * 81.0;
    assert!((mass - want).abs() < 1e-9 * want, "{mass} {want}");
    for (good, bad, message) in [
        (
            "count = 2",
            "axes = [[0.0, 0.0, 1.0]]",
            "chain.link[2].beam.axes: means nothing for a beam of this model",
        ),
        (
            "count = 2",
            "count = 11",
            "chain.link[2]: link 'lower': the number of its beam's elements or modes is 11",
        ),
        (
            "model = \"elements\"",
            "axial_stiffness = 1.0",
            "chain.link[1].beam.axial_stiffness: means nothing",
        ),
        (
            "model = \"elements\"",
            "springs = \"root\"",
            "chain.link[1].beam.model: all beams of an arm are segments, or none",
        ),
        (
            "base = \"fixed\"",
            "rotors = \"inertial\"",
            "arm.toml, line 2: chain.rotors: rotors act on links",
        ),
        (
            "origin = [4.5, 0.0, 0.0]",
            "axis = [1.0, 0.0, 0.0]",
            "link 'lower': elements and modes bend in the plane",
        ),
        (
            "stiffness = 500.0",
            "stiffness = 0.0",
            "chain.link[1].drive.stiffness: ",
        ),
    ] {
        assert!(text.contains(good), "{good}");
        let refused = chain_file_of_toml(&text.replacen(good, bad, 1), "arm.toml")
            .unwrap_err()
            .to_string();
        assert!(refused.contains(message), "{good} -> {bad}: {refused}");
    }
    let refused = chain_of_toml(&text, "arm.toml").unwrap_err().to_string();
    assert!(
        refused.contains("arm.toml, line 1: chain: its beams are finite elements or modes"),
        "{refused}"
    );
}

#[test]
fn bad_files_are_refused_with_line_and_key() {
    let cases: [(&str, &str, &str); 20] = [
        ("[chain]", "[chain", "arm.toml, line 1: "),
        (
            "base = \"fixed\"",
            "base = \"floating\"",
            "arm.toml, line 2: unknown variant `floating`",
        ),
        (
            "base = \"fixed\"",
            "bass = \"fixed\"",
            "arm.toml, line 2: unknown field `bass`",
        ),
        (
            "base = \"fixed\"",
            "base = \"free\"",
            "arm.toml, line 1: chain.body: link 'base': it moves, but",
        ),
        (
            "[0.0, 0.0, 0.0]\n[[",
            "[0.0, 0.0]\n[[",
            "arm.toml, line 3: there must be 3 numbers in this list, but it has 2",
        ),
        (
            "joint = \"elbow\"",
            "joint = \"shoulder\"",
            "arm.toml, line 15: chain.link[2]: link 'lower': its name is used twice",
        ),
        ("name = \"lower\"", "name = \"upper\"", "its name is used twice"),
        (
            "name = \"lower\"",
            "name = \"lower\"\nparent = \"forearm\"",
            "arm.toml, line 17: chain.link[2].parent: there is no link 'forearm'",
        ),
        (
            "limits = [-3.0, 3.0]",
            "limits = [3.0, -3.0]",
            "chain.link[1]: link 'upper': its lower limit 3 lies above",
        ),
        (
            "limits = [-3.0, 3.0]",
            "axis = [0.0, 0.0, 0.0]",
            "chain.link[1]: link 'upper': its joint's axis is zero",
        ),
        (
            "mass = 1.5075\n",
            "mass = -1.0\n",
            "chain.link[1]: link 'upper': its mass, kg, is -1",
        ),
        ("mass = 1.5075\n", "", "arm.toml, line 4: chain.link[1].mass: missing"),
        (
            "inertia = [0.01, 2.544, 2.544, 0.0, 0.0, 0.0]\n",
            "",
            "chain.link[1].inertia: missing",
        ),
        (
            "[0.01, 2.544, 2.544, 0.0",
            "[9.0, 2.544, 2.544, 0.0",
            "belong to no body",
        ),
        (
            "[0.01, 2.544, 2.544, 0.0, 0.0, 0.0]",
            "[0.01, 2.544]",
            "there must be 6 numbers",
        ),
        (
            "model = \"linear\"",
            "model = \"springy\"",
            "arm.toml, line 12: chain.link[1].drive.model: unknown variant `springy`",
        ),
        ("model = \"linear\"\n", "", "chain.link[1].drive.model: missing"),
        (
            "stiffness = 500.0",
            "stiffness = -5.0",
            "arm.toml, line 14: chain.link[1].drive.stiffness: ",
        ),
        (
            "stiffness = 500.0",
            "",
            "chain.link[1].drive.stiffness: missing; this model needs it, positive, in N m/rad",
        ),
        (
            "stiffness = 500.0",
            "stiffness = 500.0\nstifness = 3.0",
            "chain.link[1].drive: unknown field `stifness`",
        ),
    ];
    for (good, bad, want) in cases {
        assert!(GOOD.contains(good), "{good}");
        let message = chain_of_toml(&GOOD.replacen(good, bad, 1), "arm.toml")
            .unwrap_err()
            .to_string();
        assert!(message.contains(want), "{good} -> {bad}: {message}");
    }
}
