//! The confidence band: which one, and how it is made.

use std::ops::ControlFlow;

use clap::ValueEnum;
use flexure::bands::{Band, BandKind, BootstrapBand, RobustBand, Scheme};
use flexure::nonlinearity::{EstimatorName, NamedEstimator, NamedFit, Rule, Tuning};

use super::data::Data;
use super::estimate::slices;
use super::{Arguments, Method, method};
use crate::arguments::Usage;

/// With more rows, refits for a band are only made when they are asked for.
const MOST_REFITTED: usize = 20_000;
/// In more columns, with so many more points of the grid, neither.
const MOST_COLUMNS: usize = 3;
/// A band needs so many rows.
pub const FEWEST: usize = 5;
/// Resamples for few rows in one column; elsewhere there are fewer.
const RESAMPLES: usize = 999;
/// Resamples elsewhere.
const FEWER_RESAMPLES: usize = 199;
/// The rows that count as few.
const FEW: usize = 2_000;

/// Which band is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BandMethod {
    /// Robust where it can be, else wild bootstrap up to 20,000 rows and three columns; by blocks with --select block or
    /// block-bootstrap; none for network and for more columns, where refits take long.
    Auto,
    /// Robust bias correction: kernel estimators in one column, independent rows; for local-bandwidth that of the local
    /// line with one bandwidth.
    Robust,
    /// Wild bootstrap: any estimator, independent rows; 95 % bands of four estimators of sin 3x
    /// from 500 rows were measured to cover 94 to 96 % on average over x, single points down to 89 %.
    Bootstrap,
    /// Block bootstrap: any estimator, rows in order of time.
    Block,
    /// No band: lower and upper are NaN.
    None,
}

impl BandMethod {
    /// All of them.
    pub const ALL: [BandMethod; 5] = [
        BandMethod::Auto,
        BandMethod::Robust,
        BandMethod::Bootstrap,
        BandMethod::Block,
        BandMethod::None,
    ];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            BandMethod::Auto => "auto",
            BandMethod::Robust => "robust",
            BandMethod::Bootstrap => "bootstrap",
            BandMethod::Block => "block",
            BandMethod::None => "none",
        }
    }
}

/// What is asked of a band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BandOptions {
    /// The nominal coverage, 0.5 to 0.999.
    pub level: f64,
    /// Whether it is to hold at all points at once.
    pub simultaneous: bool,
    /// How it is made.
    pub method: BandMethod,
    /// Rows in a block; from the data where none is given.
    pub block: Option<usize>,
}

/// The band of a fitted regression at the points `at`, column by column, as `flexure regress` makes it; `None` where there is
/// none. `x`, `y` and the weights are those of the fit. `go_on` is called now and then; `Break` stops the work.
///
/// # Errors
/// Those of [`RobustBand`] and [`BootstrapBand`].
pub fn band(
    options: &BandOptions,
    (estimator, fit): (&NamedEstimator, &NamedFit),
    (x, y, weights): (&[&[f64]], &[f64], Option<&[f64]>),
    at: &[Vec<f64>],
    go_on: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> flexure::Result<Option<Band>> {
    let method = Method {
        estimator: estimator.clone(),
        level: options.level,
        simultaneous: options.simultaneous,
        band_method: options.method,
        block: options.block,
    };
    let data = Data {
        file: String::new(),
        names: Vec::new(),
        y_name: String::new(),
        x: x.to_vec(),
        y,
        weights,
    };
    let banding = banding(&method, fit, &data);
    banding.map(|b| b.band(estimator, fit, &data, at, go_on)).transpose()
}

/// How the band is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Banding {
    /// By robust bias correction.
    Robust(RobustBand),
    /// By refits to resampled data.
    Bootstrap(BootstrapBand),
}

/// Refuses a robust band for what has none, and options that would do nothing.
pub fn check(arguments: &Arguments) -> Result<(), Usage> {
    let kernel = matches!(
        method::name(arguments),
        EstimatorName::Kernel | EstimatorName::LocalLinear | EstimatorName::LocalBandwidth
    );
    if arguments.band_method == BandMethod::Robust && !(kernel && arguments.x.len() == 1) {
        return Err(Usage(
            "--band-method robust is for the estimators kernel, local-linear and local-bandwidth in one column of x; take --band-method bootstrap".to_owned(),
        ));
    }
    let blocks = matches!(arguments.select, Some(Rule::BlockBootstrap { .. }));
    if arguments.block.is_some() && !blocks && arguments.band_method != BandMethod::Block {
        return Err(Usage(
            "--block gives the rows in a block, for --select block-bootstrap or --band-method block; take one of them, or leave it out"
                .to_owned(),
        ));
    }
    if arguments.simultaneous && arguments.band_method == BandMethod::None {
        return Err(Usage(
            "--simultaneous needs a band, and --band-method none makes none; leave one of them out".to_owned(),
        ));
    }
    Ok(())
}

/// The band that the options ask for, if any.
pub fn banding(method: &Method, fit: &NamedFit, data: &Data) -> Option<Banding> {
    let rows = data.rows().len();
    let blocks = matches!(method.estimator.tuning, Tuning::FromData(rule) if rule.in_time());
    let slow =
        matches!(fit.name, EstimatorName::Network | EstimatorName::LocalBandwidth) || data.x.len() > MOST_COLUMNS;
    let chosen = match method.band_method {
        BandMethod::Auto if rows < FEWEST => BandMethod::None,
        BandMethod::Auto if blocks && !slow && rows <= MOST_REFITTED => BandMethod::Block,
        BandMethod::Auto if fit.one_bandwidth().is_some() => BandMethod::Robust,
        BandMethod::Auto if !slow && rows <= MOST_REFITTED => BandMethod::Bootstrap,
        BandMethod::Auto => BandMethod::None,
        given => given,
    };
    let kind = match method.simultaneous {
        true => BandKind::Simultaneous,
        false => BandKind::Pointwise,
    };
    let (level, seed) = (method.level, method.estimator.seed);
    let scheme = match chosen {
        BandMethod::None | BandMethod::Auto => return None,
        BandMethod::Robust => {
            let usual = RobustBand::default();
            return Some(Banding::Robust(RobustBand {
                level,
                kind,
                seed,
                // A bandwidth that was given is not one of smallest error, which a band for coverage would narrow.
                undersmoothing: match method.estimator.tuning {
                    Tuning::Fixed(_) => 0.0,
                    Tuning::FromData(_) => usual.undersmoothing,
                },
                ..usual
            }));
        }
        BandMethod::Bootstrap => Scheme::Wild,
        BandMethod::Block => Scheme::MovingBlock { length: method.block },
    };
    let resamples = match rows <= FEW && data.x.len() == 1 {
        true => RESAMPLES,
        false => FEWER_RESAMPLES,
    };
    // As many as the level's quantile needs.
    let least = (2.0 / (1.0 - level)).ceil() as usize;
    Some(Banding::Bootstrap(BootstrapBand {
        level,
        kind,
        scheme,
        resamples: resamples.max(least),
        seed,
        ..BootstrapBand::default()
    }))
}

impl Banding {
    /// Whether rows that depend on their neighbours make it too narrow.
    pub fn is_for_independent_rows(&self) -> bool {
        match self {
            Banding::Robust(_) => true,
            Banding::Bootstrap(band) => !matches!(band.scheme, Scheme::MovingBlock { .. }),
        }
    }

    /// The band at the points `at`, column by column.
    pub fn band(
        self,
        method: &NamedEstimator,
        fit: &NamedFit,
        data: &Data,
        at: &[Vec<f64>],
        go_on: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
    ) -> flexure::Result<Band> {
        match (self, fit.one_bandwidth()) {
            (Banding::Robust(band), Some(kernel)) => band.for_kernel(kernel, &at[0]),
            (Banding::Robust(band), None) => {
                let band = BootstrapBand {
                    level: band.level,
                    kind: band.kind,
                    seed: band.seed,
                    ..BootstrapBand::default()
                };
                Banding::Bootstrap(band).band(method, fit, data, at, go_on)
            }
            (Banding::Bootstrap(band), _) => {
                let fixed = method.fixed(fit);
                let refit = |x: &[&[f64]], y: &[f64], w: Option<&[f64]>| Ok(fixed.fit(x, y, w)?.regression);
                band.run(&refit, &data.x, data.y, data.weights, &slices(at), go_on)
            }
        }
    }
}

/// "pointwise" or "simultaneous".
pub fn kind_words(kind: BandKind) -> &'static str {
    match kind {
        BandKind::Pointwise => "pointwise",
        BandKind::Simultaneous => "simultaneous",
    }
}
