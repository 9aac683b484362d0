//! Light over the links: gathered by each node, pushed down to the patches, and pulled up again.

use super::tree::{Kind, Tree, TreeLink, TreeNode};
use crate::math::DVec3;
use crate::radiosity::Rgb64;
use rayon::prelude::*;
use std::f64::consts::PI;

/// The light that each node sends and receives.
pub struct Field {
    /// Mean over the area of each node, in W/m².
    pub radiosity: Vec<Rgb64>,
    pub irradiance: Vec<Rgb64>,
    /// What errors are judged against: the geometric mean of the irradiance of the surfaces of each node, in W/m².
    pub usual: Vec<f64>,
    /// Of the clusters, by their number: radiant intensity by direction.
    intensity: Vec<Sphere>,
}

/// Light by direction: radiant intensity of a small body in W/sr, or radiance that arrives in it, by the first
/// nine spherical harmonics: enough for diffuse surfaces up to a few percent (Ramamoorthi & Hanrahan 2001).
#[derive(Clone, Copy, Debug, Default)]
struct Sphere([Rgb64; 9]);

/// The clamped cosine in each band.
const COSINE: [f64; 9] = {
    let (one, two) = (2.0 * PI / 3.0, PI / 4.0);
    [PI, one, one, one, two, two, two, two, two]
};

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

impl Sphere {
    /// A surface of radiosity `b`.
    fn add_surface(&mut self, b: Rgb64, area: f64, normal: DVec3) {
        if b == Rgb64::ZERO {
            return;
        }
        let power = b * (area / PI);
        let y = harmonics(normal);
        for (c, (cosine, y)) in self.0.iter_mut().zip(COSINE.iter().zip(y)) {
            *c += power * (cosine * y);
        }
    }

    fn add(&mut self, o: &Sphere) {
        for (a, b) in self.0.iter_mut().zip(o.0) {
            *a += b;
        }
    }

    /// Light from the unit vector `d` alone: irradiance `e` on what is at right angles to it.
    fn add_from(&mut self, d: DVec3, e: Rgb64) {
        for (c, y) in self.0.iter_mut().zip(harmonics(d)) {
            *c += e * y;
        }
    }

    /// The same radiance from everywhere.
    fn add_everywhere(&mut self, radiance: Rgb64) {
        self.0[0] += radiance * (2.0 * PI.sqrt());
    }

    /// Irradiance of a surface with unit normal `n`.
    fn irradiance(&self, n: DVec3) -> Rgb64 {
        let y = harmonics(n);
        let sum: Rgb64 = (0..9).map(|i| self.0[i] * (COSINE[i] * y[i])).sum();
        sum.max(Rgb64::ZERO)
    }

    fn towards(&self, d: DVec3) -> Rgb64 {
        let y = harmonics(d);
        let sum: Rgb64 = self.0.iter().zip(y).map(|(c, y)| *c * y).sum();
        sum.max(Rgb64::ZERO)
    }
}

/// New values of one node.
pub struct Update {
    pub node: u32,
    pub radiosity: Rgb64,
    pub irradiance: Rgb64,
}

impl Field {
    /// What is emitted, and nothing else.
    pub fn new(tree: &Tree) -> Field {
        let mut field = Field {
            radiosity: tree.nodes.iter().map(|n| n.emission).collect(),
            irradiance: vec![Rgb64::ZERO; tree.nodes.len()],
            usual: Vec::new(),
            intensity: Vec::new(),
        };
        for (b, node) in field.radiosity.iter_mut().zip(&tree.nodes) {
            *b += node.albedo * node.external;
        }
        field.pull(tree);
        field
    }

    /// The same radiosity everywhere, 1 W/m².
    pub fn uniform(tree: &Tree) -> Field {
        let mut field = Field {
            radiosity: vec![Rgb64::ONE; tree.nodes.len()],
            irradiance: vec![Rgb64::ZERO; tree.nodes.len()],
            usual: Vec::new(),
            intensity: Vec::new(),
        };
        field.pull(tree);
        field
    }

    /// Only what patches emit.
    pub fn of_emission(tree: &Tree) -> Field {
        let mut field = Field {
            radiosity: tree.nodes.iter().map(|n| n.emission).collect(),
            irradiance: vec![Rgb64::ZERO; tree.nodes.len()],
            usual: Vec::new(),
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
            let usual = self.usual[node.parent as usize];
            self.usual.push(usual);
        }
    }

    /// Takes the light that there is as what errors are judged against.
    /// What is darker than `black`, as a share of the mean, counts as that dark.
    pub fn judge_by(&mut self, tree: &Tree, black: f64) {
        let mean = self.irradiance[0].max_element();
        if mean.is_nan() || mean <= 0.0 {
            self.usual = vec![self.radiosity[0].max_element(); tree.nodes.len()];
            return;
        }
        // Means of logarithms, pulled up from the patches.
        let floor = |e: Rgb64| e.max_element().max(black * mean).ln();
        let mut logs: Vec<f64> = self.irradiance.iter().map(|e| floor(*e)).collect();
        for &i in tree.by_cluster.iter().rev() {
            let i = i as usize;
            let node = &tree.nodes[i];
            if node.area > 0.0 {
                let inside = tree.children(i as u32).map(|c| c as usize);
                let sum: f64 = inside.map(|c| logs[c] * tree.nodes[c].area).sum();
                logs[i] = sum / node.area;
            }
        }
        self.usual = logs.into_iter().map(f64::exp).collect();
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

    /// What each node below clusters would send and receive next.
    pub fn gathered(&self, tree: &Tree) -> Vec<Vec<Update>> {
        /// Cells that one task gathers for.
        const CHUNK: usize = 256;
        let around = self.around_clusters(tree);
        let gather = |cells: &[u32]| {
            let mut updates = Vec::with_capacity(2 * cells.len());
            for &cell in cells {
                let node = &tree.nodes[cell as usize];
                let above = match tree.clusters.get(node.parent as usize) {
                    Some(&number) => around[number as usize].irradiance(node.normal),
                    None => Rgb64::ZERO,
                };
                self.push(tree, cell, above, &mut updates);
            }
            updates
        };
        tree.cells.par_chunks(CHUNK).map(gather).collect()
    }

    /// The light that arrives at each cluster by its links and those of the clusters around it.
    fn around_clusters(&self, tree: &Tree) -> Vec<Sphere> {
        let own = |&node: &u32| {
            let node = &tree.nodes[node as usize];
            let mut sum = Sphere::default();
            for link in &node.links {
                self.add_arriving(tree, node, link, &mut sum);
            }
            sum
        };
        let mut around: Vec<Sphere> = tree.by_cluster.par_iter().map(own).collect();
        // Clusters come before what they contain.
        for (i, &node) in tree.by_cluster.iter().enumerate() {
            let parent = tree.nodes[node as usize].parent;
            if let Some(&above) = tree.clusters.get(parent as usize) {
                let above = around[above as usize];
                around[i].add(&above);
            }
        }
        around
    }

    /// What a link brings to a cluster.
    fn add_arriving(&self, tree: &Tree, receiver: &TreeNode, link: &TreeLink, sum: &mut Sphere) {
        let sender = &tree.nodes[link.sender as usize];
        let d = sender.center - receiver.center;
        let distance = d.length();
        if distance <= receiver.radius + sender.radius {
            // From no direction in particular.
            let radiance = self.radiosity[link.sender as usize] * f64::from(link.form_factor) / PI;
            return sum.add_everywhere(radiance);
        }
        let towards = d / distance;
        let flux = self.sent_towards(tree, link.sender, -towards);
        sum.add_from(
            towards,
            flux * (f64::from(link.visible) / (distance * distance)),
        );
    }

    /// Radiant intensity of a node in W/sr towards the unit vector `d`.
    fn sent_towards(&self, tree: &Tree, sender: u32, d: DVec3) -> Rgb64 {
        let node = &tree.nodes[sender as usize];
        match node.kind {
            Kind::Surface { .. } => {
                let cos = d.dot(node.normal).max(0.0);
                self.radiosity[sender as usize] * (node.area * cos / PI)
            }
            Kind::Cluster { .. } => {
                self.intensity[tree.clusters[sender as usize] as usize].towards(d)
            }
        }
    }

    /// Irradiance of a surface by a link.
    fn received(&self, tree: &Tree, receiver: &TreeNode, link: &TreeLink) -> Rgb64 {
        let sender = &tree.nodes[link.sender as usize];
        let d = sender.center - receiver.center;
        let distance = d.length();
        let by_factor = !sender.is_cluster() || distance <= receiver.radius + sender.radius;
        if by_factor {
            return self.radiosity[link.sender as usize] * f64::from(link.form_factor);
        }
        let towards = d / distance;
        let cos = towards.dot(receiver.normal).max(0.0);
        let flux = self.sent_towards(tree, link.sender, -towards);
        flux * (cos * f64::from(link.visible) / (distance * distance))
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
            gathered += self.received(tree, n, link);
        }
        let children = tree.children(node);
        let (radiosity, irradiance) = match children.is_empty() {
            true => {
                let irradiance = gathered * n.scale + n.external;
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
        let own = |&cluster: &u32| self.of_surfaces(tree, cluster);
        let mut sums: Vec<Sum> = tree.by_cluster.par_iter().map(own).collect();
        // Clusters come before what they contain.
        for (number, &i) in tree.by_cluster.iter().enumerate().rev() {
            let node = &tree.nodes[i as usize];
            let sum = sums[number];
            if let Some(&above) = tree.clusters.get(node.parent as usize) {
                let above = &mut sums[above as usize];
                above.power += sum.power;
                above.arriving += sum.arriving;
                above.intensity.add(&sum.intensity);
            }
            let share = if node.area > 0.0 {
                1.0 / node.area
            } else {
                0.0
            };
            self.radiosity[i as usize] = sum.power * share;
            self.irradiance[i as usize] = sum.arriving * share;
        }
        self.intensity = sums.into_iter().map(|sum| sum.intensity).collect();
    }

    /// What the surfaces directly in a cluster send and get.
    fn of_surfaces(&self, tree: &Tree, cluster: u32) -> Sum {
        let mut sum = Sum::default();
        for child in tree.children(cluster).map(|c| c as usize) {
            let inside = &tree.nodes[child];
            if inside.is_cluster() {
                continue;
            }
            sum.power += self.radiosity[child] * inside.area;
            sum.arriving += self.irradiance[child] * inside.area;
            sum.intensity
                .add_surface(self.radiosity[child], inside.area, inside.normal);
        }
        sum
    }
}

/// Of all that is in a cluster.
#[derive(Clone, Copy, Default)]
struct Sum {
    /// In W, sent and received.
    power: Rgb64,
    arriving: Rgb64,
    intensity: Sphere,
}
