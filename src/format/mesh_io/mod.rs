//! Temporary.
use crate::math::{DVec3, Vec2, Vec3};
use std::path::Path;
pub struct MeshData {
    pub positions: Vec<DVec3>,
    pub normals: Option<Vec<Vec3>>,
    pub uvs: Option<Vec<Vec2>>,
    pub indices: Vec<[u32; 3]>,
}
pub fn read_ply(_: &Path, _: bool) -> Result<MeshData, String> {
    Err("ply".into())
}
pub fn read_obj(path: &Path, flip: bool) -> Result<MeshData, String> {
    let (models, _) = tobj::load_obj(path, &tobj::LoadOptions { single_index: true, triangulate: true, ..Default::default() }).map_err(|e| e.to_string())?;
    let mut d = MeshData { positions: vec![], normals: Some(vec![]), uvs: Some(vec![]), indices: vec![] };
    for m in models {
        let m = m.mesh;
        let o = d.positions.len() as u32;
        d.positions.extend(m.positions.chunks(3).map(|p| DVec3::new(p[0], p[1], p[2])));
        if let Some(n) = &mut d.normals { n.extend(m.normals.chunks(3).map(|p| Vec3::new(p[0] as f32, p[1] as f32, p[2] as f32))); }
        if let Some(n) = &mut d.uvs { n.extend(m.texcoords.chunks(2).map(|p| Vec2::new(p[0] as f32, if flip { 1.0 - p[1] as f32 } else { p[1] as f32 }))); }
        d.indices.extend(m.indices.chunks(3).map(|i| [i[0] + o, i[1] + o, i[2] + o]));
    }
    if d.normals.as_ref().unwrap().is_empty() { d.normals = None; }
    if d.uvs.as_ref().unwrap().is_empty() { d.uvs = None; }
    Ok(d)
}
