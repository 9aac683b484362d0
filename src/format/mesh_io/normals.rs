//! Smooth vertex normals where a file has none.

use super::MeshData;
use crate::math::{DVec3, Vec3};

impl MeshData {
    /// Makes all normals unit vectors. Missing ones become the sum of the normals of the faces around
    /// the vertex, weighted by the angle of each there (Thürmer and Wüthrich 1998), as in Mitsuba.
    ///
    /// A vertex whose faces are all degenerate, or cancel, gets +z.
    pub fn complete_normals(&mut self) {
        let count = self.positions.len();
        let normals = self.normals.get_or_insert_with(|| vec![Vec3::ZERO; count]);
        for n in normals.iter_mut() {
            *n = unit(n.as_dvec3());
        }
        if normals.iter().all(|n| *n != Vec3::ZERO) {
            return;
        }
        let mut sums = vec![DVec3::ZERO; count];
        for triangle in &self.indices {
            let p = triangle.map(|i| self.positions[i as usize]);
            let Some(n) = (p[1] - p[0]).cross(p[2] - p[0]).try_normalize() else {
                continue;
            };
            for k in 0..3 {
                let (a, b) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
                // atan2 keeps its precision for angles near 0 and 180 degrees.
                let angle = a.cross(b).length().atan2(a.dot(b));
                sums[triangle[k] as usize] += n * angle;
            }
        }
        for (n, sum) in normals.iter_mut().zip(sums) {
            if *n == Vec3::ZERO {
                let smooth = unit(sum);
                *n = if smooth == Vec3::ZERO {
                    Vec3::Z
                } else {
                    smooth
                };
            }
        }
    }
}

/// Of unit length, or zero for what has no direction.
fn unit(v: DVec3) -> Vec3 {
    v.normalize_or_zero().as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corner_of_a_cube_points_along_its_diagonal() {
        // Two triangles on one side and one on each of the others: angles, not faces, must count.
        let corners = [
            [0, 0, 0],
            [1, 0, 0],
            [1, 1, 0],
            [0, 1, 0],
            [0, 0, 1],
            [1, 0, 1],
            [0, 1, 1],
        ];
        let mut mesh = MeshData {
            positions: corners
                .map(|c| DVec3::from_array(c.map(f64::from)))
                .to_vec(),
            indices: vec![[0, 2, 1], [0, 3, 2], [0, 1, 4], [0, 4, 3]],
            ..MeshData::default()
        };
        mesh.complete_normals();
        let n = mesh.normals.unwrap()[0];
        assert!((n + Vec3::splat(1.0 / 3f32.sqrt())).length() < 1e-6, "{n}");
    }

    #[test]
    fn given_normals_stay_and_degenerate_vertices_get_one() {
        let mut mesh = MeshData {
            positions: vec![DVec3::ZERO; 3],
            normals: Some(vec![Vec3::new(0.0, 2.0, 0.0), Vec3::ZERO, Vec3::X]),
            indices: vec![[0, 1, 2]],
            ..MeshData::default()
        };
        mesh.complete_normals();
        assert_eq!(mesh.normals.unwrap(), [Vec3::Y, Vec3::Z, Vec3::X]);
    }
}
