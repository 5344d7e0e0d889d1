//! Bad files are refused by line and name, and good ones are read as the standard says.

use super::*;

const GOOD: &str = r#"<?xml version="1.0"?>
<robot name="arm">
<link name="base"/>
<link name="upper"><inertial><origin xyz="0.2 0 0.1" rpy="0.3 -0.4 0.5"/><mass value="2"/><inertia ixx="0.3" ixy="0.01" ixz="0.02" iyy="0.2" iyz="0" izz="0.25"/></inertial></link>
<link name="lower"><inertial><mass value="1"/><inertia ixx="0.03" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.025"/></inertial></link>
<link name="tool"><inertial><mass value="0.5"/><inertia ixx="0.003" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="0.0025"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/><limit lower="-1" upper="2"/></joint>
<joint name="elbow" type="prismatic"><origin xyz="1 0 0" rpy="0 1.5 0"/><parent link="upper"/><child link="lower"/><axis xyz="0 1 0"/></joint>
<joint name="flange" type="fixed"><parent link="lower"/><child link="tool"/></joint>
</robot>"#;

fn read(text: &str) -> Result<Chain> {
    parse_urdf(text, Path::new("arm.urdf"), &UrdfOptions::default())
}

#[test]
fn joints_come_depth_first_and_by_name() {
    let chain = read(GOOD).unwrap();
    assert_eq!(chain.joints(), ["shoulder", "elbow"]);
    assert_eq!(chain.limits(), [[-1.0, 2.0], [f64::NEG_INFINITY, f64::INFINITY]]);
    let branch = r#"<link name="second"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="a" type="continuous"><parent link="base"/><child link="second"/></joint>
</robot>"#;
    let chain = read(&GOOD.replace("</robot>", branch)).unwrap();
    assert_eq!(chain.joints(), ["a", "shoulder", "elbow"]);
}

#[test]
fn bad_files_are_refused_by_line_and_name() {
    let cases: [(&str, &str, &str); 26] = [
        ("</robot>", "", "line 1: this is no XML"),
        ("<robot name=\"arm\">", "<sdf>", "line 10: this is no XML"),
        (
            "link name=\"lower\"",
            "link name=\"upper\"",
            "line 5: the name of link 'upper' is used twice",
        ),
        (
            "joint name=\"elbow\"",
            "joint name=\"shoulder\"",
            "line 8: the name of joint 'shoulder' is used twice",
        ),
        ("<link name=\"base\"/>", "<link/>", "line 3: <link> has no name"),
        (
            "name=\"elbow\" type=\"prismatic\"",
            "name=\"elbow\"",
            "line 8: <joint> has no type",
        ),
        (
            "type=\"prismatic\"",
            "type=\"floating\"",
            "line 8: joint 'elbow' has the type 'floating'",
        ),
        (
            "type=\"prismatic\"",
            "type=\"planar\"",
            "line 8: joint 'elbow' has the type 'planar'",
        ),
        ("<parent link=\"upper\"/>", "", "line 8: joint 'elbow' has no <parent>"),
        ("<child link=\"lower\"/>", "", "line 8: joint 'elbow' has no <child>"),
        ("<parent link=\"upper\"/>", "<parent/>", "line 8: <parent> has no link"),
        (
            "<parent link=\"upper\"/>",
            "<parent link=\"uper\"/>",
            "line 8: the parent of joint 'elbow' is link 'uper'",
        ),
        (
            "<child link=\"lower\"/>",
            "<child link=\"x\"/>",
            "line 8: the child of joint 'elbow' is link 'x'",
        ),
        (
            "<child link=\"tool\"/>",
            "<child link=\"upper\"/>",
            "line 9: link 'upper' hangs on two joints, 'shoulder' and 'flange'",
        ),
        (
            "<child link=\"tool\"/>",
            "<child link=\"base\"/>",
            "line 7: joint 'shoulder' belongs to a closed loop",
        ),
        (
            "<parent link=\"base\"/>",
            "<parent link=\"tool\"/>",
            "line 9: joint 'flange' belongs to a closed loop",
        ),
        (
            "<link name=\"base\"/>",
            "<link name=\"base\"/><link name=\"alone\"/>",
            "line 3: 2 links are no joint's child, among them 'alone' and 'base'",
        ),
        (
            "<limit lower",
            "<mimic joint=\"elbow\"/><limit lower",
            "line 7: joint 'shoulder' mimics another joint",
        ),
        (
            "xyz=\"1 0 0\"",
            "xyz=\"1 0\"",
            "line 8: xyz of <origin> is '1 0', which is not three finite numbers",
        ),
        (
            "rpy=\"0 1.5 0\"",
            "rpy=\"0 nan 0\"",
            "line 8: rpy of <origin> is '0 nan 0'",
        ),
        (
            "axis xyz=\"0 1 0\"",
            "axis xyz=\"0 0 0\"",
            "line 5: link 'lower': its joint's axis is zero",
        ),
        (
            "upper=\"2\"",
            "upper=\"-2\"",
            "line 4: link 'upper': its lower limit -1 lies above its upper limit -2",
        ),
        ("<mass value=\"2\"/>", "", "line 4: <inertial> has no <mass>"),
        (
            "<mass value=\"2\"/>",
            "<mass value=\"two\"/>",
            "line 4: value of <mass> is 'two'",
        ),
        (
            "<mass value=\"2\"/>",
            "<mass value=\"-2\"/>",
            "line 4: link 'upper': its mass, kg, is -2",
        ),
        (
            "ixx=\"0.3\"",
            "ixx=\"3\"",
            "line 4: link 'upper': its moments of inertia belong to no body",
        ),
    ];
    for (good, bad, want) in cases {
        assert!(GOOD.contains(good), "{good}");
        let message = read(&GOOD.replacen(good, bad, 1)).unwrap_err().to_string();
        assert!(
            message.starts_with(&format!("arm.urdf, {want}")),
            "{bad}: {want}: {message}"
        );
    }
    let ring = "<joint name=\"ring\" type=\"fixed\"><parent link=\"tool\"/><child link=\"base\"/></joint></robot>";
    let ring = GOOD.replace("</robot>", ring);
    for (text, want) in [
        (&ring[..], "line 2: every link is the child of a joint"),
        (
            "<sdf/>",
            "line 1: the first element is <sdf>; a URDF begins with <robot>",
        ),
        ("<robot/>", "line 1: the robot has no <link>"),
        (
            "<robot><link name='a'/></robot>",
            "line 1: link 'a': the chain has no joint that moves",
        ),
        (
            "<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\n<xacro:macro/></robot>",
            "line 2: this is a xacro file",
        ),
    ] {
        let message = read(text).unwrap_err().to_string();
        assert!(message.starts_with(&format!("arm.urdf, {want}")), "{message}");
    }
    let massless = GOOD.replace("<mass value=\"2\"/>", "<mass value=\"0\"/>");
    let massless = without_moments(&massless);
    let message = read(&massless).unwrap_err().to_string();
    assert!(
        message
            .starts_with("arm.urdf, line 4: link 'upper': it moves, but neither it nor what is fixed to it has a mass"),
        "{message}"
    );
}

/// The upper link with moments of zero.
fn without_moments(text: &str) -> String {
    text.replace(
        "ixx=\"0.3\" ixy=\"0.01\" ixz=\"0.02\" iyy=\"0.2\" iyz=\"0\" izz=\"0.25\"",
        "ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"0\"",
    )
}
