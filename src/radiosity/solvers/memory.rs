//! How much memory a solver may take.

use crate::radiosity::{SolveError, Solver};
use std::fs;

/// Where the system does not say how much is free.
const UNKNOWN: u64 = 4 << 30;

/// Refuses what would not fit, before anything is allocated.
pub(super) fn check(solver: Solver, patches: u64) -> Result<(), SolveError> {
    // A quarter stays for the scene and everything else.
    check_against(solver, patches, available() / 4 * 3)
}

fn check_against(solver: Solver, patches: u64, limit: u64) -> Result<(), SolveError> {
    let square = patches
        .saturating_mul(patches)
        .saturating_mul(size_of::<f64>() as u64);
    let bytes = match solver {
        // The form factors, and a decomposition per channel.
        Solver::Gauss => square.saturating_mul(4),
        Solver::GaussSeidel | Solver::Jacobi => square,
        Solver::Shooting | Solver::Hierarchical => return Ok(()),
    };
    match bytes > limit {
        true => Err(SolveError::TooLarge {
            solver: solver.name(),
            patches,
            bytes,
        }),
        false => Ok(()),
    }
}

/// Bytes that may be taken without swapping, as far as the system says.
fn available() -> u64 {
    let text = fs::read_to_string("/proc/meminfo").unwrap_or_default();
    let line = text.lines().find_map(|l| l.strip_prefix("MemAvailable:"));
    let kib = line.and_then(|l| l.split_whitespace().next()?.parse::<u64>().ok());
    kib.map_or(UNKNOWN, |kib| kib.saturating_mul(1024))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_must_fit() {
        let gib = 1 << 30;
        assert_eq!(check_against(Solver::Gauss, 5_000, gib), Ok(()));
        assert_eq!(check_against(Solver::Jacobi, 11_000, gib), Ok(()));
        assert_eq!(check_against(Solver::Shooting, u64::MAX, gib), Ok(()));
        let error = check_against(Solver::Gauss, 6_000, gib).unwrap_err();
        let text = "the solver gauss needs 1098 MiB for the form factors of 6000 patches: make patches larger, \
                    or use the solver shooting or hierarchical";
        assert_eq!(error.to_string(), text);
        for solver in [Solver::Gauss, Solver::GaussSeidel, Solver::Jacobi] {
            assert!(check(solver, 10_000_000).is_err());
            assert!(check(solver, u64::MAX).is_err());
        }
    }
}
