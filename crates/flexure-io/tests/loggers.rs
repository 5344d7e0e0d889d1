//! Text files of loggers, scripts and instruments.

mod common;

use common::{read, refused};

#[test]
fn the_newest_sample_first_with_instants_that_neighbours_share() {
    let file = read(
        "shared_instants",
        "t,u,y,z\n3,5,5,1\n2,4,x,1\n2,3,3,1\n1,2,2,1\n0,1,1,z\n",
    );
    assert_eq!(file.column("t").unwrap(), [0.0, 1.0, 2.0, 2.0, 3.0]);
    assert_eq!(file.column("u").unwrap(), [1.0, 2.0, 3.0, 4.0, 5.0]);
    // Samples are counted in the order that they are taken in.
    let flawed: Vec<String> = file.flawed().collect();
    assert!(
        flawed[0].starts_with("line 3: column 'y' holds 'x' at sample 3,"),
        "{flawed:?}"
    );
    assert!(
        flawed[1].starts_with("line 6: column 'z' holds 'z' at sample 0,"),
        "{flawed:?}"
    );
    let file = read(
        "shared_stamps",
        "Date,Time,u\n2026-03-02,00:00:01,5\n2026-03-02,00:00:00,4\n2026-03-02,00:00:00,3\n2026-03-01,23:59:59,2\n",
    );
    assert_eq!(file.column("Time").unwrap(), [0.0, 1.0, 1.0, 2.0]);
    assert_eq!(file.column("u").unwrap(), [2.0, 3.0, 4.0, 5.0]);
    // A clock that stands still has no order.
    let file = read("stopped_clock", "t,u\n5,1\n5,2\n5,3\n");
    assert_eq!(file.column("u").unwrap(), [1.0, 2.0, 3.0]);
}

#[test]
fn twice_as_many_fields_between_tabs_are_no_decimal_commas() {
    let said = refused("tabs_twice", "t\tu\n0\t1\n1\t2\t3\t4\n2\t3\n");
    assert!(
        said.contains("4 fields where there are 2 columns; every line"),
        "{said}"
    );
}
