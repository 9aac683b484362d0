//! Light over the links: gathered by each node, pushed down to the patches, and pulled up again.

use super::tree::{Kind, NONE, Tree, TreeLink};
use crate::math::DVec3;
use crate::radiosity::Rgb64;
use rayon::prelude::*;
use std::f64::consts::PI;

/// The light that each node sends and receives.
pub struct Field {
    /// Mean over the area of each node, in W/m².
    pub radiosity: Vec<Rgb64>,
    pub irradiance: Vec<Rgb64>,
    /// Of the clusters, and cells below: radiant intensity by direction.
    intensity: Vec<Intensity>,
}

/// Radiant intensity of a small body, in W/sr, by its first nine spherical harmonics: enough for the light of
/// diffuse surfaces up to a few percent (Ramamoorthi & Hanrahan 2001).
#[derive(Clone, Copy, Debug, Default)]
struct Intensity([Rgb64; 9]);

/// Real spherical harmonics up to the second band.
fn harmonics(d: DVec3) -> [f64; 9] {
    let (x, y, z) = (d.x, d.y, d.z);
    [
        0.282_094_791_773_878_14,
        0.488_602_511_902_919_9 * y,
        0.488_602_511_902_919_9 * z,
        0.488_602_511_902_919_9 * x,
        1.092_548_430_592_079 * x * y,
        1.092_548_430_592_079 * y * z,
        0.315_391_565_252_520_05 * (3.0 * z * z - 1.0),
        1.092_548_430_592_079 * x * z,
        0.546_274_215_296_039_5 * (x * x - y * y),
    ]
}

impl Intensity {
    /// A surface of radiosity `b`.
    fn of_surface(b: Rgb64, area: f64, normal: DVec3) -> Intensity {
        // The clamped cosine in each band.
        const BANDS: [f64; 9] = {
            let (one, two) = (2.0 * PI / 3.0, PI / 4.0);
            [PI, one, one, one, two, two, two, two, two]
        };
        let power = b * (area / PI);
        let y = harmonics(normal);
        Intensity(std::array::from_fn(|i| power * (BANDS[i] * y[i])))
    }

    fn add(&mut self, o: &Intensity) {
        for (a, b) in self.0.iter_mut().zip(o.0) {
            *a += b;
        }
    }

    fn towards(&self, d: DVec3) -> Rgb64 {
        let y = harmonics(d);
        let sum: Rgb64 = self.0.iter().zip(y).map(|(c, y)| *c * y).sum();
        sum.max(Rgb64::ZERO)
    }
}

/// New values of one node.
struct Update {
    node: u32,
    radiosity: Rgb64,
    irradiance: Rgb64,
}

impl Field {
    /// What is emitted, and nothing else.
    pub fn new(tree: &Tree) -> Field {
        let mut field = Field {
            radiosity: tree.nodes.iter().map(|n| n.emission).collect(),
            irradiance: vec![Rgb64::ZERO; tree.nodes.len()],
            intensity: Vec::new(),
        };
        for (b, node) in field.radiosity.iter_mut().zip(&tree.nodes) {
            *b += node.albedo * node.external;
        }
        field.pull(tree);
        field
    }

    /// Only what patches emit.
    pub fn of_emission(tree: &Tree) -> Field {
        let mut field = Field {
            radiosity: tree.nodes.iter().map(|n| n.emission).collect(),
            irradiance: vec![Rgb64::ZERO; tree.nodes.len()],
            intensity: Vec::new(),
        };
        field.pull(tree);
        field
    }

    /// Gives nodes that are new the light of their parents; what they emit and reflect differently counts.
    pub fn grow(&mut self, tree: &Tree) {
        for i in self.radiosity.len()..tree.nodes.len() {
            let node = &tree.nodes[i];
            let parent = &tree.nodes[node.parent as usize];
            let irradiance = self.irradiance[node.parent as usize];
            let same = node.albedo == parent.albedo && node.emission == parent.emission;
            self.radiosity.push(match same {
                true => self.radiosity[node.parent as usize],
                false => node.emission + node.albedo * irradiance.max(node.external),
            });
            self.irradiance.push(irradiance);
        }
    }

    /// All nodes gather what the others send. Gives Σ A |ΔB| over the patches, summed over the channels, in W.
    pub fn step(&mut self, tree: &Tree) -> f64 {
        let updates = self.gathered(tree);
        let mut change = 0.0;
        for update in updates.iter().flatten() {
            let node = update.node as usize;
            if tree.children(update.node).is_empty() {
                let difference = (update.radiosity - self.radiosity[node]).abs();
                change += difference.element_sum() * tree.nodes[node].area;
            }
            self.radiosity[node] = update.radiosity;
            self.irradiance[node] = update.irradiance;
        }
        self.pull(tree);
        change
    }

    /// Irradiance that the light of this field makes, per node below the clusters.
    pub fn arriving(&self, tree: &Tree) -> Vec<Rgb64> {
        let mut irradiance = vec![Rgb64::ZERO; tree.nodes.len()];
        for update in self.gathered(tree).iter().flatten() {
            irradiance[update.node as usize] = update.irradiance;
        }
        irradiance
    }

    fn gathered(&self, tree: &Tree) -> Vec<Vec<Update>> {
        let gather = |&cell: &u32| {
            let mut updates = Vec::new();
            let above = self.from_above(tree, cell);
            self.push(tree, cell, above, &mut updates);
            updates
        };
        tree.cells.par_iter().map(gather).collect()
    }

    /// Irradiance of a cell by what its clusters are linked to.
    fn from_above(&self, tree: &Tree, cell: u32) -> Rgb64 {
        let receiver = &tree.nodes[cell as usize];
        let mut sum = Rgb64::ZERO;
        let mut above = receiver.parent;
        while above != NONE {
            let cluster = &tree.nodes[above as usize];
            for link in &cluster.links {
                sum += self.seen_from(tree, receiver.center, receiver.normal, link);
            }
            above = cluster.parent;
        }
        sum
    }

    /// Irradiance at a point by a link, by direction and distance.
    fn seen_from(&self, tree: &Tree, p: DVec3, n: DVec3, link: &TreeLink) -> Rgb64 {
        let sender = &tree.nodes[link.sender as usize];
        let d = sender.center - p;
        let d2 = d.length_squared();
        let cos = d.dot(n);
        if !(cos > 0.0) || link.visible == 0.0 {
            return Rgb64::ZERO;
        }
        let distance = d2.sqrt();
        // Within a body's own size, its light does not grow any more.
        let falloff =
            f64::from(link.visible) * (cos / distance) / d2.max(sender.radius * sender.radius);
        match sender.kind {
            Kind::Surface { .. } => {
                let cos = (-d.dot(sender.normal) / distance).max(0.0);
                self.radiosity[link.sender as usize] * (sender.area * cos * falloff / PI)
            }
            Kind::Cluster { .. } => {
                self.intensity[link.sender as usize].towards(-d / distance) * falloff
            }
        }
    }

    /// Brings light to the patches below `node` and back up: gives the mean radiosity and irradiance.
    fn push(
        &self,
        tree: &Tree,
        node: u32,
        above: Rgb64,
        updates: &mut Vec<Update>,
    ) -> (Rgb64, Rgb64) {
        let n = &tree.nodes[node as usize];
        let mut gathered = above;
        for link in &n.links {
            gathered += match tree.nodes[link.sender as usize].is_cluster() {
                true => self.seen_from(tree, n.center, n.normal, link),
                false => self.radiosity[link.sender as usize] * f64::from(link.form_factor),
            };
        }
        let children = tree.children(node);
        let (radiosity, irradiance) = match children.is_empty() {
            true => {
                let irradiance = gathered + n.external;
                (n.emission + n.albedo * irradiance, irradiance)
            }
            false => {
                let mut mean = (Rgb64::ZERO, Rgb64::ZERO);
                for child in children {
                    let (b, e) = self.push(tree, child, gathered, updates);
                    mean = (mean.0 + b * 0.25, mean.1 + e * 0.25);
                }
                mean
            }
        };
        updates.push(Update {
            node,
            radiosity,
            irradiance,
        });
        (radiosity, irradiance)
    }

    /// Means and intensities of the clusters, by what they contain.
    fn pull(&mut self, tree: &Tree) {
        let count = tree
            .cells
            .iter()
            .copied()
            .max()
            .map_or(0, |m| m as usize + 1);
        self.intensity.clear();
        self.intensity.resize(count, Intensity::default());
        for i in (0..count).rev() {
            let node = &tree.nodes[i];
            match node.kind {
                Kind::Surface { .. } => {
                    let b = self.radiosity[i];
                    self.intensity[i] = Intensity::of_surface(b, node.area, node.normal);
                }
                Kind::Cluster { first, count } => {
                    let (mut power, mut arriving) = (Rgb64::ZERO, Rgb64::ZERO);
                    let mut sum = Intensity::default();
                    for child in first as usize..(first + count) as usize {
                        power += self.radiosity[child] * tree.nodes[child].area;
                        arriving += self.irradiance[child] * tree.nodes[child].area;
                        sum.add(&self.intensity[child]);
                    }
                    let share = if node.area > 0.0 {
                        1.0 / node.area
                    } else {
                        0.0
                    };
                    self.radiosity[i] = power * share;
                    self.irradiance[i] = arriving * share;
                    self.intensity[i] = sum;
                }
            }
        }
    }
}
