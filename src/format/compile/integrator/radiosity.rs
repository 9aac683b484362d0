//! Radiosity: how it is solved for, shown, and used by path tracers.

use crate::format::compile::{on_command_line, suggest};
use crate::format::{Overrides, Props, SceneError};
use crate::radiosity::{FormFactorMethod, LEAST_WALKS, SolveSpec, Solver};
use crate::transport::radiosity::{GUIDE_ERROR, Indirect, Show};
use crate::transport::{CacheSpec, IntegratorSpec, PathSpec, RadiositySpec};

/// Parameters that only a solution needs.
const SOLVING: [&str; 12] = [
    "solver",
    "form_factors",
    "resolution",
    "samples",
    "patch_size",
    "min_size",
    "error",
    "walks",
    "residual",
    "max_steps",
    "curve_error",
    "max_patches",
];

/// How radiosity is solved for, from the parameters that all integrators with a use of it share.
/// What is not given is as in `defaults`.
pub fn solve(props: &Props, defaults: SolveSpec) -> Result<SolveSpec, SceneError> {
    let solver = props.string("solver")?;
    let solver = Solver::ALL.into_iter().find(|s| s.name() == solver);
    let solver = solver.unwrap_or(defaults.solver);
    let optional = |name: &str| match props.is_given(name) {
        true => props.float(name).map(Some),
        false => Ok(None),
    };
    if solver != Solver::Hierarchical {
        for name in ["min_size", "error", "walks"] {
            if props.is_given(name) {
                let what = format!(
                    "\"{name}\" has no effect with the solver \"{}\"",
                    solver.name()
                );
                let help = "leave it out, or use the solver \"hierarchical\"";
                return Err(props.error_at(name, what).with_help(help));
            }
        }
    }
    let walks = u64::try_from(props.int("walks")?).ok();
    if walks.is_some_and(|n| (1..LEAST_WALKS).contains(&n)) {
        let what = format!("so few \"walks\" say too little: {}", walks.unwrap_or(0));
        let help = format!("give 0, to trust links, or at least {LEAST_WALKS}");
        return Err(props.error_at("walks", what).with_help(help));
    }
    let max_steps = u64::try_from(props.int("max_steps")?).ok();
    Ok(SolveSpec {
        solver,
        form_factors: form_factors(props)?,
        patch_size: optional("patch_size")?,
        min_size: optional("min_size")?,
        error: optional("error")?.unwrap_or(defaults.error),
        walks: walks.unwrap_or(defaults.walks),
        residual: props.float("residual")?,
        max_steps,
        curve_error: props.float("curve_error")?,
        max_patches: props.int("max_patches")? as u64,
        ..defaults
    })
}

fn form_factors(props: &Props) -> Result<FormFactorMethod, SceneError> {
    let method = props.string("form_factors")?;
    let (method, used, unused) = match method {
        "hemicube" => {
            let resolution = props.int("resolution")? as u32;
            (
                FormFactorMethod::Hemicube { resolution },
                "resolution",
                "samples",
            )
        }
        other => {
            let samples = props.int("samples")? as u32;
            let method = match other {
                "montecarlo" => FormFactorMethod::MonteCarlo { samples },
                _ => FormFactorMethod::Analytic { samples },
            };
            (method, "samples", "resolution")
        }
    };
    if props.is_given(unused) {
        let name = method.name();
        let what = format!("\"{unused}\" has no effect with form factors by \"{name}\"");
        let help = format!("use \"{used}\"");
        return Err(props.error_at(unused, what).with_help(help));
    }
    props.ignore(&[unused]);
    Ok(method)
}

/// The integrator "radiosity".
pub fn shown(props: &Props, path: PathSpec) -> Result<IntegratorSpec, SceneError> {
    let show = props.string("show")?;
    let show = Show::ALL.into_iter().find(|d| d.name() == show);
    Ok(IntegratorSpec::Radiosity(RadiositySpec {
        path,
        solve: solve(props, SolveSpec::default())?,
        show: show.unwrap_or_default(),
        given: None,
    }))
}

/// The use that a path tracer makes of radiosity: what the command line wants, if it says so, else what the scene does.
pub fn cache(props: &Props, wanted: Option<Indirect>) -> Result<CacheSpec, SceneError> {
    let name = props.string("indirect")?;
    let named = Indirect::ALL.into_iter().find(|i| i.name() == name);
    let indirect = wanted.or(named).unwrap_or_default();
    if indirect == Indirect::None {
        let unused = SOLVING.into_iter().find(|name| props.is_given(name));
        // What the command line switches off may keep its settings.
        if let (Some(name), None) = (unused, wanted) {
            let what = format!("\"{name}\" has no effect without radiosity");
            let help = "leave it out, or set \"indirect\" to \"gather\" or \"guide\"";
            return Err(props.error_at(name, what).with_help(help));
        }
        props.ignore(&SOLVING);
        return Ok(CacheSpec::default());
    }
    let mut solve = solve(props, CacheSpec::default().solve)?;
    if indirect == Indirect::Guide {
        if solve.solver != Solver::Hierarchical && wanted.is_none() {
            return Err(props
                .error_at("solver", no_links(solve.solver))
                .with_help(INSTEAD));
        }
        if !props.is_given("error") {
            solve.error = GUIDE_ERROR;
        }
    }
    Ok(CacheSpec {
        indirect,
        solve,
        given: None,
        always: false,
    })
}

/// What the command line wants of light between diffuse surfaces.
pub fn wanted(overrides: &Overrides) -> Result<Option<Indirect>, SceneError> {
    let Some(name) = &overrides.indirect else {
        return Ok(None);
    };
    let found = Indirect::ALL.into_iter().find(|i| i.name() == name);
    found.map(Some).ok_or_else(|| {
        let what = format!("unknown way \"{name}\" to find indirect light");
        let help = suggest(name, Indirect::ALL.map(Indirect::name));
        on_command_line("--indirect", name, what).with_help(help)
    })
}

/// `spec` with what the command line wants of light between diffuse surfaces.
pub fn overridden(
    spec: IntegratorSpec,
    wanted: Option<Indirect>,
) -> Result<IntegratorSpec, SceneError> {
    let Some(indirect) = wanted else {
        return Ok(spec);
    };
    let error = |what: String| on_command_line("--indirect", indirect.name(), what);
    match spec.cache() {
        Some(cache)
            if indirect == Indirect::Guide && cache.solve.solver != Solver::Hierarchical =>
        {
            Err(error(no_links(cache.solve.solver)).with_help(INSTEAD))
        }
        // Nothing was asked of the solution.
        Some(cache) if cache.solve == CacheSpec::default().solve => {
            Ok(spec.with_cache(CacheSpec::of(indirect)))
        }
        Some(cache) => Ok(spec.with_cache(CacheSpec { indirect, ..cache })),
        None => {
            let name = spec.name();
            let what = format!("the integrator \"{name}\" finds indirect light in its own way");
            let help = "leave --indirect out, or give --integrator path or combined";
            Err(error(what).with_help(help))
        }
    }
}

/// Walks are guided by links.
fn no_links(solver: Solver) -> String {
    format!(
        "the solver \"{}\" makes no links that walks could be guided by",
        solver.name()
    )
}

const INSTEAD: &str = "use the solver \"hierarchical\"";
