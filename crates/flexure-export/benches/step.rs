//! The time of one step of the exported C, compared with Rust's free run: `cargo bench -p flexure-export --bench step`.
//!
//! One model of each form, 100,000 samples, the least time of 20 runs. C is compiled by `cc -O2`; its times are those of the calls of the step
//! alone. Rust's free run works block by block on whole signals.

#[path = "../tests/common/mod.rs"]
#[allow(dead_code)] // The comparison is for the tests.
mod common;

use std::hint::black_box;
use std::process::Command;
use std::time::Instant;

use common::{FORMS, inputs, models};
use flexure_export::{Fmi, Format, Options, export};

const SAMPLES: usize = 100_000;
const RUNS: usize = 20;

/// Prints the least time of a step, ns.
const MAIN: &str = r#"
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "model.h"
int main(void) {
    static double u[SAMPLES * INPUTS];
    static model_state state;
    double least = 1e300, sum = 0.0;
    FILE *file = fopen("u.bin", "rb");
    if (file == NULL || fread(u, sizeof u, 1, file) != 1) return 1;
    for (int run = 0; run < RUNS; run++) {
        struct timespec start, end;
        model_init(&state);
        clock_gettime(CLOCK_MONOTONIC, &start);
        for (long n = 0; n < SAMPLES; n++) sum += model_step(&state, ARGUMENT);
        clock_gettime(CLOCK_MONOTONIC, &end);
        double ns = (double)(end.tv_sec - start.tv_sec) * 1e9 + (double)(end.tv_nsec - start.tv_nsec);
        if (ns < least) least = ns;
    }
    if (sum == 1e-300) puts("");
    printf("%.3f\n", least / SAMPLES);
    return 0;
}
"#;

fn main() {
    println!("structure             Rust, ns   C, ns   C / Rust");
    for (k, (structure, model)) in models().iter().enumerate().take(FORMS) {
        let u = inputs(model, SAMPLES, k as u64);
        let slices: Vec<&[f64]> = u.iter().map(Vec::as_slice).collect();
        let run = |_| {
            let start = Instant::now();
            black_box(model.block.simulate_from_first(black_box(&slices)).ok());
            start.elapsed().as_secs_f64()
        };
        let rust = (0..RUNS).map(run).fold(f64::INFINITY, f64::min) / SAMPLES as f64 * 1e9;

        let folder = tempfile::tempdir().unwrap();
        let options = Options {
            format: Format::C,
            name: None,
            fmi: Fmi::default(),
            compile: false,
        };
        for artefact in export(model, &folder.path().join("model.c"), options).unwrap() {
            std::fs::write(artefact.path, artefact.bytes).unwrap();
        }
        let bytes = (0..SAMPLES).flat_map(|n| u.iter().flat_map(move |u| u[n].to_ne_bytes()));
        std::fs::write(folder.path().join("u.bin"), bytes.collect::<Vec<u8>>()).unwrap();
        let argument = if u.len() == 1 { "u[n]" } else { "&u[n * INPUTS]" };
        let constants = format!(
            "#define SAMPLES {SAMPLES}\n#define RUNS {RUNS}\n#define INPUTS {}\n",
            u.len()
        );
        std::fs::write(
            folder.path().join("main.c"),
            constants + &MAIN.replace("ARGUMENT", argument),
        )
        .unwrap();
        let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".to_owned());
        let arguments = ["-std=c99", "-O2", "model.c", "main.c", "-o", "program"];
        let done = Command::new(compiler)
            .args(arguments)
            .current_dir(folder.path())
            .status()
            .unwrap();
        assert!(done.success());
        let done = Command::new(folder.path().join("program"))
            .current_dir(folder.path())
            .output()
            .unwrap();
        let c: f64 = String::from_utf8_lossy(&done.stdout).trim().parse().unwrap();
        println!("{structure:20} {rust:9.1} {c:7.1} {:10.2}", c / rust);
    }
}
