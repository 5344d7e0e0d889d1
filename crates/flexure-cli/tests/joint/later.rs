//! `flexure joint --validate`: what was found, on another log of the same joint.

use super::cannot_tell::{PLAIN, as_it_is, multisine};
use super::common::Folder;

const JOINT: &str = "joint log.csv --position q --torque tau --validate";

/// A log, another one of the same axis, and one of an axis that needs a quarter more torque.
fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("log.csv", PLAIN.log(|t, _| multisine(t), as_it_is));
    folder.write("later.csv", PLAIN.log(|t, _| multisine(t + 33.0), as_it_is));
    let heavier = PLAIN.log(|t, _| multisine(t + 50.0), |[q, tau]| [q, 1.25 * tau]);
    folder.write("heavier.csv", heavier);
    folder
}

#[test]
fn another_log_of_the_joint_judges_what_was_found() {
    let folder = folder();
    let found = folder.json(&format!("{JOINT} later.csv"));
    let later = &found["later"];
    assert_eq!((&later["log"], &later["holds"]), (&"later.csv".into(), &true.into()));
    assert_eq!(
        (later["samples"].as_u64(), later["sample_time"].as_f64()),
        (Some(10_000), Some(0.002))
    );
    let number = |name: &str| later["torque"][name].as_f64().unwrap();
    assert!(
        number("fit_percent") > 98.0 && number("own_fit_percent") > 98.0,
        "{later}"
    );
    // The torque of the multisine has a mean square of 5 3^2 / 2.
    assert!(number("rms") < 0.02 * 22.5_f64.sqrt(), "{later}");
    assert!(later["motions"][0]["fit_percent"].as_f64().unwrap() > 95.0, "{later}");
    let text = folder.said(&format!("{JOINT} later.csv --report page.html"));
    assert!(
        text.contains("it holds on later.csv") && !text.contains("next:"),
        "{text}"
    );
    let page = folder.read("page.html");
    assert!(page.contains("reconstructed from the motion, on later.csv") && page.contains("It holds on later.csv"));
    // The verdict's fit of the torque stands beside that of all frequencies, for both logs.
    assert_eq!(page.matches("The verdict counts only frequencies up to").count(), 2);
}

#[test]
fn a_joint_that_became_another_one_is_said_in_the_first_line() {
    let folder = folder();
    let text = folder.said(&format!("{JOINT} heavier.csv --report page.html"));
    let first: String = text.lines().take_while(|line| !line.starts_with("  log ")).collect();
    assert!(first.contains("it does not") && first.contains("heavier.csv"), "{text}");
    assert!(text.contains("identify the joint from heavier.csv too"), "{text}");
    assert!(
        folder
            .read("page.html")
            .contains("What was found does not hold on the other log")
    );
    // A torque 1.25 times as large leaves a fifth of itself.
    let found = folder.json(&format!("{JOINT} heavier.csv"));
    let missed = 100.0 - found["later"]["torque"]["fit_percent"].as_f64().unwrap();
    assert!((missed - 20.0).abs() < 1.0, "{missed}");
}

#[test]
fn several_axes_are_judged_each_on_its_own_columns() {
    let folder = folder();
    let columns = |file: &str| [folder.column(file, "q"), folder.column(file, "tau")];
    let write = |name: &str, first: &str, second: &str| {
        let ([q1, tau1], [q2, tau2]) = (columns(first), columns(second));
        let rows = (0..q1.len()).map(|i| {
            let t = 0.002 * i as f64;
            format!("{t},{},{},{},{}\n", q1[i], tau1[i], q2[i], tau2[i])
        });
        folder.write(name, "t,q1,tau1,q2,tau2\n".to_owned() + &rows.collect::<String>());
    };
    write("both.csv", "log.csv", "log.csv");
    write("both-later.csv", "later.csv", "heavier.csv");
    let command = "joint both.csv --axis 1..2 --position q{} --torque tau{} --validate both-later.csv";
    let found = folder.json(command);
    let holds: Vec<_> = (0..2).map(|i| found["axes"][i]["later"]["holds"].as_bool()).collect();
    assert_eq!(holds, [Some(true), Some(false)]);
    let text = folder.said(command);
    assert!(
        text.contains("not on the other log") && text.contains("each alone; 1 holds"),
        "{text}"
    );
}

#[test]
fn another_log_that_cannot_be_used_is_named() {
    let folder = folder();
    folder.write("short.csv", "t,q,tau\n0,0,1\n0.002,0.1,2\n");
    folder.failed(
        &format!("{JOINT} short.csv"),
        "short.csv: a joint's friction and inertia needs at least 200 samples, but there are 2",
    );
    folder.write("other.csv", folder.read("later.csv").replace("t,q,tau", "t,angle,tau"));
    folder.failed(
        &format!("{JOINT} other.csv"),
        "other.csv: no column 'q'; the columns are: t, angle, tau",
    );
    folder.misused(
        &format!("{JOINT} later.csv --report later.csv"),
        "later.csv is read and would be overwritten; give the output another name",
    );
}
