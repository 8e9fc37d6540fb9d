//! Embree, from a library that is named at run time.
//!
//! Only the functions used here are declared, after the public documentation of versions 3.13 and 4.

#![expect(unsafe_code, reason = "calls of a C library; every call is given what its documentation asks for")]

use std::array;
use std::ffi::{c_char, c_int, c_uint, c_void};
use std::mem::ManuallyDrop;
use std::path::Path;
use std::ptr;
use std::sync::atomic::{AtomicIsize, Ordering};

use libloading::Library;
use meshray::accel::{NO_PRIM, Ray, Shapes};
use meshray::math::simd::Level;

use crate::tracer::{Answer, PACKET, Packet, Rays, Tracer};

type Device = *mut c_void;
type Scene = *mut c_void;
type Geometry = *mut c_void;

const INVALID: u32 = u32::MAX;
const ROBUST: c_int = 1 << 2;
const MEDIUM: c_int = 1;
const TRIANGLES: c_int = 0;
const INDEX_BUFFER: c_int = 0;
const VERTEX_BUFFER: c_int = 1;
const FORMAT_UINT3: c_int = 0x5003;
const FORMAT_FLOAT3: c_int = 0x9003;
const COHERENT: c_int = 1 << 16;
const COHERENT_3: c_int = 1;
const ONLY_TRIANGLES: c_int = 1 << 1;

/// Packet widths that a device may support natively, and the properties to query for that.
const WIDTHS: [(usize, c_int); 3] = [(16, 34), (8, 33), (4, 32)];

/// Mask of the lanes that hold a ray: −1 for each that does. The library requires the alignment.
#[repr(C, align(64))]
struct Valid<const N: usize>([c_int; N]);

/// `RTCRayHit` and, with `N` of 4, 8, 16, `RTCRayHit4` and so on; with room for the fields that either version appends.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
struct RayHit<const N: usize> {
    org: [[f32; N]; 3],
    tnear: [f32; N],
    dir: [[f32; N]; 3],
    time: [f32; N],
    tfar: [f32; N],
    mask: [u32; N],
    id: [u32; N],
    flags: [u32; N],
    normal: [[f32; N]; 3],
    uv: [[f32; N]; 2],
    prim: [u32; N],
    geometry: [u32; N],
    instance: [u32; N],
    instance_prim: [u32; N],
}

impl<const N: usize> RayHit<N> {
    const EMPTY: Self = Self {
        org: [[0.0; N]; 3],
        tnear: [0.0; N],
        dir: [[0.0; N]; 3],
        time: [0.0; N],
        tfar: [0.0; N],
        mask: [u32::MAX; N],
        id: [0; N],
        flags: [0; N],
        normal: [[0.0; N]; 3],
        uv: [[0.0; N]; 2],
        prim: [INVALID; N],
        geometry: [INVALID; N],
        instance: [INVALID; N],
        instance_prim: [INVALID; N],
    };

    #[inline(always)]
    fn set(&mut self, lane: usize, ray: &Ray) {
        for k in 0..3 {
            self.org[k][lane] = ray.origin[k];
            self.dir[k][lane] = ray.dir[k];
        }
        self.tnear[lane] = ray.t_min;
        self.tfar[lane] = ray.t_max;
        self.geometry[lane] = INVALID;
        self.prim[lane] = INVALID;
    }

    /// Sets all lanes from those of a packet from `first` on: origin, direction, and end.
    #[inline(always)]
    fn set_all(&mut self, packet: &Packet, first: usize) {
        // Whole rows: the library loads them as vectors, and would stall on rows that were stored number by number.
        let [ox, oy, oz, dx, dy, dz, end] =
            packet.each_ref().map(|row| row[first..].first_chunk().unwrap_or(&[0.0; N]));
        self.org = [*ox, *oy, *oz];
        self.dir = [*dx, *dy, *dz];
        self.tfar = *end;
        self.geometry = [INVALID; N];
    }

    #[inline(always)]
    fn answer(&self, lane: usize) -> Answer {
        let found = self.geometry[lane] != INVALID;
        Answer { prim: if found { self.prim[lane] } else { NO_PRIM }, t: self.tfar[lane] }
    }
}

/// `RTCIntersectArguments`, `RTCOccludedArguments` of version 4; `RTCIntersectContext` of version 3.
#[repr(C)]
struct Arguments {
    flags: c_int,
    features: c_int,
    pointers: [*mut c_void; 3],
    width: f32,
}

#[repr(C)]
struct Context3 {
    flags: c_int,
    filter: *mut c_void,
    instance: u32,
    width: f32,
}

type Query1 = unsafe extern "C" fn(Scene, *mut c_void, *mut c_void);
type QueryN = unsafe extern "C" fn(*const c_int, Scene, *mut c_void, *mut c_void);
type Monitor = unsafe extern "C" fn(*mut c_void, isize, bool) -> bool;

static HELD: AtomicIsize = AtomicIsize::new(0);

unsafe extern "C" fn monitor(_: *mut c_void, bytes: isize, _: bool) -> bool {
    HELD.fetch_add(bytes, Ordering::Relaxed);
    true
}

/// The loaded library. It is never unloaded: its threads outlive the last scene.
pub(crate) struct Embree {
    library: ManuallyDrop<Library>,
    pub version: String,
    major: isize,
    isa: &'static str,
    /// Width of the widest packets that the device supports natively.
    pub widest: usize,
}

/// A scene built by the library.
pub(crate) struct Built<'e> {
    embree: &'e Embree,
    scene: Scene,
    device: Device,
    robust: bool,
    /// Rays in a packet; 1: ray by ray.
    packet: usize,
    /// Size of the structure, bytes.
    pub bytes: usize,
}

/// Device configuration that limits the library to the instruction set of a level.
fn isa(level: Level) -> &'static str {
    match level.word() {
        "portable" if cfg!(target_arch = "x86_64") => ",isa=sse2",
        "avx2" => ",isa=avx2",
        _ => "",
    }
}

impl Embree {
    /// Loads the library, preceded by a TBB beside it, if there is one. The library is limited to the instruction set of a level.
    pub(crate) fn load(path: &Path, level: Level) -> Result<Self, String> {
        for entry in path.parent().into_iter().filter_map(|p| p.read_dir().ok()).flatten().flatten() {
            let name = entry.file_name();
            if name.to_string_lossy().starts_with("libtbb") {
                // SAFETY: a library of the user's choice runs its initialisers.
                let _ = unsafe { Library::new(entry.path()) }.map(ManuallyDrop::new);
            }
        }
        // SAFETY: as above.
        let library = unsafe { Library::new(path) }.map_err(|e| format!("{}: {e}", path.display()))?;
        let mut embree =
            Self { library: ManuallyDrop::new(library), version: String::new(), major: 0, widest: 1, isa: isa(level) };
        let device = embree.device(1);
        // SAFETY: the signature is the documented one; property 0 is the version, others are packet widths.
        let property = |which| unsafe {
            embree.function::<unsafe extern "C" fn(Device, c_int) -> isize>("rtcGetDeviceProperty")(device, which)
        };
        let number = property(0);
        let widest = WIDTHS.into_iter().find(|&(_, which)| property(which) != 0).map_or(1, |(width, _)| width);
        embree.widest = widest;
        embree.major = number / 10_000;
        embree.version = format!("Embree {}.{}.{}", number / 10_000, number / 100 % 100, number % 100);
        Ok(embree)
    }

    fn function<T: Copy>(&self, name: &str) -> T {
        // SAFETY: callers name the type given by the documentation.
        let symbol = unsafe { self.library.get::<T>(name.as_bytes()) };
        *symbol.unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    fn device(&self, threads: usize) -> Device {
        let config = format!("threads={threads},set_affinity=0{}\0", self.isa);
        // SAFETY: the string ends with 0.
        unsafe {
            self.function::<unsafe extern "C" fn(*const c_char) -> Device>("rtcNewDevice")(config.as_ptr().cast())
        }
    }

    /// Builds a scene; `time` is called around the build alone.
    pub(crate) fn build<T>(
        &self,
        shapes: &Shapes,
        robust: bool,
        threads: usize,
        time: impl FnOnce(&mut dyn FnMut()) -> T,
    ) -> (Built<'_>, T) {
        let device = self.device(threads);
        // SAFETY: documented signatures and enumerators; the buffers have the requested sizes.
        unsafe {
            self.function::<unsafe extern "C" fn(Device, Monitor, *mut c_void)>("rtcSetDeviceMemoryMonitorFunction")(
                device,
                monitor,
                ptr::null_mut(),
            );
            let scene = self.function::<unsafe extern "C" fn(Device) -> Scene>("rtcNewScene")(device);
            let set_flags = self.function::<unsafe extern "C" fn(Scene, c_int)>("rtcSetSceneFlags");
            set_flags(scene, if robust { ROBUST } else { 0 });
            self.function::<unsafe extern "C" fn(Scene, c_int)>("rtcSetSceneBuildQuality")(scene, MEDIUM);
            let geometry =
                self.function::<unsafe extern "C" fn(Device, c_int) -> Geometry>("rtcNewGeometry")(device, TRIANGLES);
            self.function::<unsafe extern "C" fn(Geometry, c_int)>("rtcSetGeometryBuildQuality")(geometry, MEDIUM);
            type NewBuffer = unsafe extern "C" fn(Geometry, c_int, c_uint, c_int, usize, usize) -> *mut c_void;
            let new_buffer = self.function::<NewBuffer>("rtcSetNewGeometryBuffer");
            let vertices =
                new_buffer(geometry, VERTEX_BUFFER, 0, FORMAT_FLOAT3, 12, shapes.vertices.len()).cast::<f32>();
            for (i, v) in shapes.vertices.iter().flat_map(|v| v.to_array()).enumerate() {
                vertices.add(i).write(v);
            }
            let indices = new_buffer(geometry, INDEX_BUFFER, 0, FORMAT_UINT3, 12, shapes.triangles.len()).cast::<u32>();
            for (i, &v) in shapes.triangles.iter().flatten().enumerate() {
                indices.add(i).write(v);
            }
            self.function::<unsafe extern "C" fn(Geometry)>("rtcCommitGeometry")(geometry);
            self.function::<unsafe extern "C" fn(Scene, Geometry) -> c_uint>("rtcAttachGeometry")(scene, geometry);
            self.function::<unsafe extern "C" fn(Geometry)>("rtcReleaseGeometry")(geometry);
            let commit = self.function::<unsafe extern "C" fn(Scene)>("rtcCommitScene");
            let before = HELD.load(Ordering::Relaxed);
            let timed = time(&mut || commit(scene));
            let bytes = usize::try_from(HELD.load(Ordering::Relaxed) - before).unwrap_or(0);
            (Built { embree: self, scene, device, robust, packet: 1, bytes }, timed)
        }
    }
}

impl Drop for Built<'_> {
    fn drop(&mut self) {
        // SAFETY: both were made by this library and are released once.
        unsafe {
            self.embree.function::<unsafe extern "C" fn(Scene)>("rtcReleaseScene")(self.scene);
            self.embree.function::<unsafe extern "C" fn(Device)>("rtcReleaseDevice")(self.device);
        }
    }
}

impl Built<'_> {
    /// Makes queries use packets of 4, 8 or 16 rays, or trace ray by ray with 1.
    pub(crate) fn with_packets(&mut self, rays: usize) -> &mut Self {
        self.packet = rays;
        self
    }

    /// Traces all rays.
    fn ask(&self, any: bool, coherent: bool, rays: Rays, answers: &mut [Answer]) {
        let mut arguments = Arguments {
            flags: if coherent { COHERENT } else { 0 },
            features: ONLY_TRIANGLES,
            pointers: [ptr::null_mut(); 3],
            width: 1.0,
        };
        let mut context = Context3 {
            flags: if coherent { COHERENT_3 } else { 0 },
            filter: ptr::null_mut(),
            instance: INVALID,
            width: 1.0,
        };
        let arguments = ptr::from_mut(&mut arguments).cast::<c_void>();
        let context = ptr::from_mut(&mut context).cast::<c_void>();
        match self.packet {
            4 => self.ask_packets::<4>(any, rays.packets, answers, arguments, context),
            8 => self.ask_packets::<8>(any, rays.packets, answers, arguments, context),
            16 => self.ask_packets::<16>(any, rays.packets, answers, arguments, context),
            _ => self.ask_one_by_one(any, rays.all, answers, arguments, context),
        }
    }

    /// Traces packets; `N` divides [`PACKET`].
    fn ask_packets<const N: usize>(
        &self,
        any: bool,
        packets: &[Packet],
        answers: &mut [Answer],
        arguments: *mut c_void,
        context: *mut c_void,
    ) {
        let query = self.embree.function::<QueryN>(&format!("rtc{}{N}", verb(any)));
        let mut packet = RayHit::<N>::EMPTY;
        for (rays, answers) in packets.iter().zip(answers.chunks_mut(PACKET)) {
            for (first, answers) in (0..PACKET).step_by(N).zip(answers.chunks_mut(N)) {
                let valid = Valid::<N>(array::from_fn(|lane| if lane < answers.len() { -1 } else { 0 }));
                packet.set_all(rays, first);
                let packet_at = ptr::from_mut(&mut packet).cast();
                // SAFETY: the packet has the documented layout and more room than either version writes to; version 4
                // takes the arguments last, version 3 the context before the packet.
                unsafe {
                    if self.embree.major >= 4 {
                        query(valid.0.as_ptr(), self.scene, packet_at, arguments);
                    } else {
                        query(valid.0.as_ptr(), self.scene, context, packet_at);
                    }
                }
                for (lane, answer) in answers.iter_mut().enumerate() {
                    *answer = if any { occluded(packet.tfar[lane]) } else { packet.answer(lane) };
                }
            }
        }
    }

    fn ask_one_by_one(
        &self,
        any: bool,
        rays: &[Ray],
        answers: &mut [Answer],
        arguments: *mut c_void,
        context: *mut c_void,
    ) {
        let query = self.embree.function::<Query1>(&format!("rtc{}1", verb(any)));
        let mut one = RayHit::<1>::EMPTY;
        for (ray, answer) in rays.iter().zip(answers) {
            one.set(0, ray);
            let one_at = ptr::from_mut(&mut one).cast();
            // SAFETY: as above.
            unsafe {
                if self.embree.major >= 4 {
                    query(self.scene, one_at, arguments);
                } else {
                    query(self.scene, context, one_at);
                }
            }
            *answer = if any { occluded(one.tfar[0]) } else { one.answer(0) };
        }
    }
}

/// Name of a query in the library's functions.
fn verb(any: bool) -> &'static str {
    if any { "Occluded" } else { "Intersect" }
}

fn occluded(tfar: f32) -> Answer {
    Answer { prim: if tfar < 0.0 { 0 } else { NO_PRIM }, t: 0.0 }
}

impl Tracer for Built<'_> {
    fn name(&self) -> String {
        let mode = if self.robust { " robust" } else { "" };
        let how = if self.packet > 1 { format!("packets of {}", self.packet) } else { "ray by ray".into() };
        format!("{}{mode}, {how}", self.embree.version)
    }

    fn trace(&self, any: bool, coherent: bool, rays: Rays, answers: &mut [Answer]) {
        self.ask(any, coherent, rays, answers);
    }
}
