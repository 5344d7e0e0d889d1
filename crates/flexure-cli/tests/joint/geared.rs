//! A motor whose encoder and torque are before its gear.

use super::common::Folder;
use super::shoulder;

/// The names of the columns are those that drives give. The joint twists, so that the ratio of the motions is not quite that of the gear.
#[test]
fn a_motor_before_its_gear_is_seen_from_the_link() {
    const RATIO: f64 = 50.0;
    let folder = Folder::new();
    folder.write(
        "shoulder.toml",
        shoulder(1, 1.0).replace("linear = 500.0", "linear = 5000.0"),
    );
    folder.done("simulate shoulder.toml -o one.csv");
    let text = folder.read("one.csv");
    let names: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let column = |name: &str| names.iter().position(|n| *n == name).unwrap();
    let [time, motor, link, torque] = ["t", "qm1", "q1", "tau1"].map(column);
    let mut geared = "t,MotorPos,SetPos,LinkPos,ActTorque\n".to_owned();
    for line in text.lines().skip(1) {
        let values: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
        let (at_motor, torque) = (RATIO * values[motor], values[torque] / RATIO);
        let (time, link) = (values[time], values[link]);
        geared += &format!("{time},{at_motor},{},{link},{torque}\n", link + 1e-3);
    }
    folder.write("geared.csv", geared);
    let said = folder.done("look geared.csv");
    let next = "next: flexure joint geared.csv --motor MotorPos --link LinkPos --torque ActTorque --gear-ratio 50 --report report.html\n";
    assert!(said.ends_with(next), "{said}");
    let columns = "--motor MotorPos --link LinkPos --torque ActTorque";
    folder.refused(
        &format!("joint geared.csv {columns}"),
        1,
        "geared.csv: 'MotorPos' goes 50.09 times as far as 'LinkPos', as an angle before the gear does: --gear-ratio 50 divides it by the gear \
         ratio and multiplies the torque by it; take the ratio of the gear's data sheet",
    );
    let commands = [
        &format!("joint geared.csv {columns} --gear-ratio 50"),
        "joint one.csv --motor qm1 --link q1 --torque tau1",
    ];
    let [geared, plain] = commands.map(|command| folder.json(command)["link_inertia"]["value"].as_f64().unwrap());
    assert!((geared / plain - 1.0).abs() < 1e-3, "{geared} {plain}");
}
