//! Chain files say the chain that they describe, and bad ones are refused with line and key.

use flexure::manipulator::chain::{Base, ChainSimulation, simulate_chain};
use flexure_io::arm::{chain_of_toml, is_chain};

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
