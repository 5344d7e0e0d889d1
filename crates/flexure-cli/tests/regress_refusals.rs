//! What `flexure regress` refuses: what is wrong, where, and what to do; nothing is written.

mod common;

use common::Folder;

fn folder() -> Folder {
    let folder = Folder::new();
    let mut text = "x,y,v,w,one\n".to_owned();
    for i in 0..60 {
        let x = f64::from(i * 37 % 60) / 30.0;
        text += &format!("{x},{},{},{},1\n", x * x + 0.1 * f64::from(i % 7), i * 11 % 60, i % 2);
    }
    folder.write("r.csv", text);
    folder
}

fn regress(options: &str) -> String {
    format!("regress r.csv -o new.csv --report new.html {options}")
}

#[test]
fn columns_that_cannot_be() {
    let folder = folder();
    let available = "the columns are: x, y, v, w, one";
    folder.failed(&regress("--x u --y y"), &format!("r.csv: no column 'u'; {available}"));
    folder.failed(&regress("--x x --y z"), &format!("r.csv: no column 'z'; {available}"));
    folder.failed(
        &regress("--x x --y y --weights z"),
        &format!("r.csv: no column 'z'; {available}"),
    );
    folder.misused(&regress("--x x,v,x --y y"), "--x names 'x' twice; name each once");
    folder.misused(&regress("--x x --x x --y y"), "--x names 'x' twice; name each once");
    folder.misused(
        &regress("--x v,x --y x"),
        "--x and --y both name 'x'; a column cannot be regressed on itself",
    );
    folder.misused(
        &regress("--x x --y y --weights y"),
        "--weights and --y both name 'y'; name two different columns",
    );
    folder.misused(
        &regress("--x x,,v --y y"),
        "--x 'x,,v' names an empty column ''; separate the names by single commas",
    );
    folder.misused(
        &regress("--x y --y x"),
        "--x names a column 'y', and the result has a column of that name besides; rename it in the record, or leave -o out and take --json",
    );
    folder.failed(
        &regress("--x one --y y"),
        "r.csv: column 'one' is constant (1); nothing can be identified from it",
    );
    folder.failed(
        &regress("--x x --y one"),
        "r.csv: column 'one' is constant (1); nothing can be identified from it",
    );
    folder.misused(
        &regress("--x x,v --y y --estimator spline"),
        "--estimator spline takes one column of x, and --x names 2; name fewer, or take --estimator kernel or local-linear or knn or network",
    );
    folder.misused(
        &regress("--x a,b,c,d,e,f,g --y y --estimator knn"),
        "--estimator knn takes at most 6 columns of x, and --x names 7; name fewer columns",
    );
}

#[test]
fn parameters_that_are_not_the_estimators() {
    let folder = folder();
    folder.misused(
        &regress("--x x --y y --bandwidth -1"),
        "invalid value '-1' for '--bandwidth <auto|H[,H...]>': expected 'auto' or positive numbers separated by commas",
    );
    folder.misused(
        &regress("--x x --y y --bandwidth 0.1,0.2"),
        "--bandwidth gives 2 values for 1 column of x; give one for all, or one a column",
    );
    folder.misused(
        &regress("--x x --y y --estimator knn --bandwidth 0.1"),
        "--bandwidth: --estimator knn has no bandwidth; its parameter is neighbours, given by --parameter",
    );
    folder.misused(
        &regress("--x x --y y --parameter 3"),
        "--parameter: the parameter of --estimator local-linear is its bandwidth, given by --bandwidth",
    );
    folder.misused(
        &regress("--x x --y y --estimator haar --parameter 2.5"),
        "--parameter 2.5: the parameter of --estimator haar is levels, a whole number",
    );
    folder.misused(
        &regress("--x x --y y --estimator spline --kernel uniform"),
        "--kernel: --estimator spline has no kernel; leave it out, or choose an estimator that has one",
    );
    folder.misused(
        &regress("--x x --y y --estimator spline --select plugin"),
        "--select plugin: --estimator spline with 1 column of x is chosen by loo, gcv, block",
    );
    folder.misused(
        &regress("--x x,v --y y --select bootstrap"),
        "--select bootstrap: --estimator local-linear with 2 columns of x is chosen by loo, gcv, block",
    );
    folder.misused(
        &regress("--x x --y y --estimator kernel --select plugin"),
        "--select plugin: --estimator kernel with 1 column of x is chosen by loo, gcv, block, bootstrap, block-bootstrap; the plug-in rule is \
         made for the local line: --estimator local-linear",
    );
    folder.misused(
        &regress("--x x --y y --estimator local-bandwidth --select gcv"),
        "--select gcv: --estimator local-bandwidth with 1 column of x is chosen by loo, plugin",
    );
    folder.misused(
        &regress("--x x --y y --bandwidth 0.3 --select bootstrap"),
        "--select bootstrap chooses what --bandwidth gives; leave one of them out",
    );
    folder.misused(
        &regress("--x x --y y --estimator knn --parameter 5 --select loo"),
        "--select loo chooses what --parameter gives; leave one of them out",
    );
    folder.misused(
        &regress("--x x --y y --select bootstrap --block 10"),
        "--block gives the rows in a block, for --select block-bootstrap or --band-method block; take one of them, or leave it out",
    );
    folder.misused(
        &regress("--x x --y y --select block-bootstrap --block 0"),
        "invalid value '0' for '--block <ROWS>': expected a whole number from 1",
    );
    folder.failed(
        &regress("--x x --y y --select block-bootstrap --block 61"),
        "r.csv: the number of residuals in a block is 61, but must be at least 1 and at most the number of samples",
    );
    folder.misused(
        &regress("--x x --y y --estimator spline --band-method robust"),
        "--band-method robust is for the estimators kernel, local-linear and local-bandwidth in one column of x; take --band-method bootstrap",
    );
    folder.misused(
        &regress("--x x --y y --estimator magic"),
        "invalid value 'magic' for '--estimator <NAME>'\n  [possible values: kernel, local-linear, local-bandwidth, knn, fourier, cosine, \
         legendre, hermite, haar, polynomial, spline, network, recursive]",
    );
    folder.misused(
        &regress("--x x --y y --band 95"),
        "invalid value '95' for '--band <LEVEL>': expected a number from 0.5 to 0.999; 95 % is 0.95",
    );
    folder.failed(
        &regress("--x x --y y --estimator polynomial --parameter 64"),
        "r.csv: the degree is 64, but these data allow at most 59: there are no more distinct values of x; choose it smaller or take more samples",
    );
    folder.failed(
        &regress("--x x --y y --estimator knn --parameter 61"),
        "r.csv: the number of neighbours is 61, but these data allow at most 60: the weights of all points add up to no more; choose it \
         smaller or take more samples",
    );
}

#[test]
fn columns_out_of_scale() {
    let folder = Folder::new();
    for (size, message) in [("1e-310", "1.9e-309"), ("1e300", "1.9e301"), ("1e-120", "1.9e-119")] {
        let mut text = "u,v,one,big\n".to_owned();
        for i in 0..20 {
            text += &format!("{i}e{},{},1,{i}e{}\n", &size[2..], i * 7 % 20, &size[2..]);
        }
        folder.write("r.csv", text);
        let range = "choose a unit in which that is between 1e-100 and 1e100";
        for (x, y, column) in [("u", "v", "u"), ("v", "u", "u"), ("v,u", "big", "u")] {
            for estimator in ["local-linear", "knn", "network", "kernel"] {
                folder.failed(
                    &regress(&format!("--x {x} --y {y} --estimator {estimator}")),
                    &format!("r.csv: the values of column '{column}' reach {message} in size; {range}"),
                );
            }
        }
    }
}

#[test]
fn rows_that_cannot_be_used() {
    let folder = folder();
    folder.write("r.csv", "x,y,w\n1,2,1\n2,,1\n3,1,-1\n4,4,0\n");
    folder.failed(
        &regress("--x x --y y"),
        "r.csv, line 3: column 'y' is NaN or missing at sample 1; remove or repair that sample",
    );
    folder.write("r.csv", "x,y,w\n1,2,1\n2,3,1\n3,1,-1\n4,4,0\n");
    folder.failed(
        &regress("--x x --y y --weights w"),
        "r.csv, line 4: column 'w' is -1 at sample 2, but a weight must be zero or positive",
    );
    folder.write("r.csv", "x,v,y,w\n1,2,1,0\n2,3,1,0\n3,1,1,0\n");
    folder.failed(
        &regress("--x x --y y --weights w"),
        "r.csv: all weights in column 'w' are zero; at least some rows must count",
    );
    folder.write("r.csv", "a,b,c,y\n1,2,1,0\n2,3,1,0\n3,1,1,0\n");
    folder.failed(
        &regress("--x a,b,c --y y"),
        "r.csv: 3 rows for 3 columns of x; a regression needs more rows than columns: name fewer columns, or take more samples",
    );
    folder.failed(
        "regress nowhere.csv --x x --y y",
        "cannot read nowhere.csv: there is no such file or directory",
    );
}

#[test]
fn outputs_and_points_that_cannot_be() {
    let folder = folder();
    folder.refused(
        "regress r.csv --x x --y y -o curve.txt",
        2,
        "cannot write curve.txt: a record's file name must end in .csv or .parquet",
    );
    folder.misused(
        "regress r.csv --x x,v --y y --grid 2000",
        "--grid 2000 along 2 columns makes 4000000 points, and at most 1000000 are allowed; take a coarser grid, or --at",
    );
    folder.write("at.csv", "v\n1\n");
    folder.failed(
        &regress("--x x --y y --at at.csv"),
        "at.csv: no column 'x'; the columns are: v",
    );
    folder.write("at.csv", "x\n1\nnan\n");
    folder.failed(
        &regress("--x x --y y --at at.csv"),
        "at.csv, line 3: column 'x' is NaN or missing at sample 1; remove or repair that sample",
    );
}

#[test]
fn the_record_is_never_written_over() {
    let folder = folder();
    let before = folder.read("r.csv");
    let read = |path: &str| format!("{path} is read and would be overwritten; give the output another name");
    folder.misused("regress r.csv --x x --y y -o r.csv", &read("r.csv"));
    folder.misused(
        "regress r.csv --x x --y y -o new.csv --report ./r.csv",
        &read("./r.csv"),
    );
    folder.misused("identify r.csv --input x --output y -o r.csv", &read("r.csv"));
    folder.misused(
        "regress r.csv --x x --y y -o new.csv --report new.csv",
        "new.csv would be written twice; give every output a name of its own",
    );
    assert!(folder.read("r.csv") == before);
}
