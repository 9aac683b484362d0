//! Pictures of a solution on its way.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::args::{RadiosityArgs, Show};
use crate::cli::Failure;
use crate::cli::render::scene_name;
use crate::radiosity::{Patch, Progress, Report, Rgb64, Solution};
use crate::render::{Job, Metadata, Stop};
use crate::transport::radiosity as shown;
use crate::transport::radiosity::Solved;
use crate::transport::{IntegratorSpec, RadiositySpec};

/// Renders what a solver has found by certain steps.
pub(super) struct Snapshots {
    folder: PathBuf,
    steps: Vec<u64>,
    job: Job,
    stop: Stop,
    show: shown::Show,
    metadata: Metadata,
    spent: Duration,
    written: usize,
}

impl Snapshots {
    /// `job` has the scene that is solved; what it renders with is replaced.
    pub fn new(
        folder: &Path,
        args: &RadiosityArgs,
        job: Job,
        command_line: &str,
    ) -> Result<Snapshots, Failure> {
        std::fs::create_dir_all(folder).map_err(|e| {
            Failure::Output(format!("cannot make the folder {}: {e}", folder.display()))
        })?;
        Ok(Snapshots {
            folder: folder.to_path_buf(),
            steps: args.snapshot_steps.clone(),
            job,
            stop: Stop::Spp(args.snapshot_spp),
            show: match args.show {
                Show::Flat => shown::Show::Flat,
                Show::Gouraud => shown::Show::Gouraud,
            },
            metadata: Metadata {
                scene: scene_name(args.scene.as_deref()),
                command_line: command_line.to_string(),
                ..Metadata::default()
            },
            spent: Duration::ZERO,
            written: 0,
        })
    }

    /// Writes a picture if one of this step is wanted; `ambient`: with light that is not shot yet as if it were
    /// everywhere.
    pub fn see(&mut self, progress: &Progress, ambient: bool) -> Result<(), Failure> {
        // Not every solver shows every step: a later one stands in for one that was not seen.
        let due = |step: &u64| *step <= progress.step;
        if !self.steps.iter().any(due) {
            return Ok(());
        }
        self.steps.retain(|step| !due(step));
        let everywhere = match ambient {
            true => progress.ambient,
            false => Rgb64::ZERO,
        };
        let arrived = |(patch, b): (&Patch, &Rgb64)| {
            let reflected = *b - patch.emission;
            let e = reflected / patch.albedo;
            // Where nothing is reflected, what arrives cannot be seen.
            Rgb64::select(patch.albedo.cmpgt(Rgb64::ZERO), e, Rgb64::ZERO).max(Rgb64::ZERO)
                + everywhere
        };
        let patches = progress.mesh.patches.iter().zip(progress.radiosity);
        let irradiance: Vec<Rgb64> = patches.map(arrived).collect();
        let solution = Solution {
            mesh: progress.mesh.clone(),
            radiosity: progress.radiosity.to_vec(),
            direct: vec![Rgb64::ZERO; irradiance.len()],
            irradiance,
            hierarchy: None,
            report: Report::default(),
        };
        self.write(Arc::new(solution), &format!("step-{:06}", progress.step))
    }

    /// Writes the picture of the result.
    pub fn finish(&mut self, solution: &Arc<Solution>) -> Result<(), Failure> {
        self.write(Arc::clone(solution), "result")
    }

    /// Time that the pictures took.
    pub fn spent(&self) -> Duration {
        self.spent
    }

    pub fn written(&self) -> usize {
        self.written
    }

    fn write(&mut self, solution: Arc<Solution>, name: &str) -> Result<(), Failure> {
        let start = Instant::now();
        self.job.integrator = IntegratorSpec::Radiosity(RadiositySpec {
            show: self.show,
            given: Some(Solved(solution)),
            ..RadiositySpec::default()
        });
        let rendered = self.job.render(self.stop, |_, _| ControlFlow::Continue(()));
        let (film, stats) = rendered.map_err(|e| Failure::Input(e.to_string()))?;
        let image = self.job.picture(&film, &stats, &self.metadata);
        for extension in ["exr", "png"] {
            image.write(self.folder.join(format!("{name}.{extension}")))?;
        }
        self.written += 1;
        self.spent += start.elapsed();
        Ok(())
    }
}
