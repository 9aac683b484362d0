//! The few functions of Embree 3 that a comparison needs, bound by hand.
#![allow(unsafe_code)]

use super::scenes::Mesh;
use luxel::geom::Ray;
use std::ffi::{c_char, c_void};
use std::ptr::{null, null_mut};

#[repr(C, align(16))]
struct RtcRay {
    o: [f32; 3],
    tnear: f32,
    d: [f32; 3],
    time: f32,
    tfar: f32,
    mask: u32,
    id: u32,
    flags: u32,
}

#[repr(C, align(16))]
struct RtcRayHit {
    ray: RtcRay,
    ng: [f32; 3],
    uv: [f32; 2],
    prim: u32,
    geom: u32,
    inst: u32,
}

#[repr(C)]
struct Context {
    flags: i32,
    filter: *const c_void,
    inst: u32,
    more: [u32; 7],
}

#[link(name = "embree3")]
unsafe extern "C" {
    fn rtcNewDevice(config: *const c_char) -> *mut c_void;
    fn rtcNewScene(device: *mut c_void) -> *mut c_void;
    fn rtcSetSceneFlags(scene: *mut c_void, flags: i32);
    fn rtcNewGeometry(device: *mut c_void, kind: i32) -> *mut c_void;
    fn rtcSetNewGeometryBuffer(
        geometry: *mut c_void,
        kind: i32,
        slot: u32,
        format: i32,
        stride: usize,
        count: usize,
    ) -> *mut c_void;
    fn rtcCommitGeometry(geometry: *mut c_void);
    fn rtcAttachGeometry(scene: *mut c_void, geometry: *mut c_void) -> u32;
    fn rtcCommitScene(scene: *mut c_void);
    fn rtcReleaseScene(scene: *mut c_void);
    fn rtcReleaseDevice(device: *mut c_void);
    fn rtcReleaseGeometry(geometry: *mut c_void);
    fn rtcIntersect1(scene: *mut c_void, context: *mut Context, ray: *mut RtcRayHit);
    fn rtcOccluded1(scene: *mut c_void, context: *mut Context, ray: *mut RtcRay);
}

const ROBUST: i32 = 1 << 2;
const UINT3: i32 = 0x5003;
const FLOAT3: i32 = 0x9003;

/// A scene of one mesh.
pub struct Embree {
    device: *mut c_void,
    scene: *mut c_void,
}

impl Embree {
    pub fn build(mesh: &Mesh, robust: bool) -> Embree {
        // SAFETY: as Embree's manual asks; the buffers are written within the counts given.
        unsafe {
            let device = rtcNewDevice(null());
            assert!(!device.is_null(), "no Embree device");
            let scene = rtcNewScene(device);
            rtcSetSceneFlags(scene, if robust { ROBUST } else { 0 });
            let geometry = rtcNewGeometry(device, 0);
            let n = mesh.positions.len();
            let p = rtcSetNewGeometryBuffer(geometry, 1, 0, FLOAT3, 12, n).cast::<[f32; 3]>();
            for (i, v) in mesh.positions.iter().enumerate() {
                *p.add(i) = v.to_array();
            }
            let n = mesh.indices.len();
            let p = rtcSetNewGeometryBuffer(geometry, 0, 0, UINT3, 12, n).cast::<[u32; 3]>();
            for (i, &t) in mesh.indices.iter().enumerate() {
                *p.add(i) = t;
            }
            rtcCommitGeometry(geometry);
            rtcAttachGeometry(scene, geometry);
            rtcReleaseGeometry(geometry);
            rtcCommitScene(scene);
            Embree { device, scene }
        }
    }

    fn context() -> Context {
        Context {
            flags: 0,
            filter: null(),
            inst: u32::MAX,
            more: [0; 7],
        }
    }

    fn ray(ray: &Ray) -> RtcRay {
        RtcRay {
            o: ray.o.to_array(),
            tnear: 0.0,
            d: ray.d.to_array(),
            time: 0.0,
            tfar: ray.t_max,
            mask: u32::MAX,
            id: 0,
            flags: 0,
        }
    }

    /// Distance of the nearest meeting.
    pub fn intersect(&self, ray: &Ray) -> Option<f32> {
        let mut hit = RtcRayHit {
            ray: Embree::ray(ray),
            ng: [0.0; 3],
            uv: [0.0; 2],
            prim: u32::MAX,
            geom: u32::MAX,
            inst: u32::MAX,
        };
        // SAFETY: the structures have the layout of Embree's headers.
        unsafe { rtcIntersect1(self.scene, &mut Embree::context(), &mut hit) };
        (hit.geom != u32::MAX).then_some(hit.ray.tfar)
    }

    pub fn occluded(&self, ray: &Ray) -> bool {
        let mut ray = Embree::ray(ray);
        // SAFETY: the structures have the layout of Embree's headers.
        unsafe { rtcOccluded1(self.scene, &mut Embree::context(), &mut ray) };
        ray.tfar < 0.0
    }
}

impl Drop for Embree {
    fn drop(&mut self) {
        // SAFETY: made by `build`, released once.
        unsafe {
            rtcReleaseScene(self.scene);
            rtcReleaseDevice(self.device);
        }
        self.scene = null_mut();
    }
}
