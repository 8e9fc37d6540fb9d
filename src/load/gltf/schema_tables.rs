//! Tables of the glTF 2.0 schema and those of its extensions, for [`super::schema`].

use super::schema::{Extension, Kind, Object, Property, Range};
use Kind::{Any, AnyIndex, Bool, Index, Integer, List, Map, Number, OneOf, Text, Word};

const INF: f64 = f64::INFINITY;
const NUMBER: Kind = Number(Range { min: -INF, max: INF, open: false });
const NOT_NEGATIVE: Kind = Number(Range { min: 0.0, max: INF, open: false });
const POSITIVE: Kind = Number(Range { min: 0.0, max: INF, open: true });
const UNIT: Kind = Number(Range { min: 0.0, max: 1.0, open: false });
const SIZE: Kind = Integer { min: 1, max: u64::MAX };
const OFFSET: Kind = Integer { min: 0, max: u64::MAX };
const SET: Kind = Integer { min: 0, max: u32::MAX as u64 };

const fn need(name: &'static str, kind: Kind) -> Property {
    Property { name, kind, required: true }
}

const fn may(name: &'static str, kind: Kind) -> Property {
    Property { name, kind, required: false }
}

/// A non-empty list.
const fn some(of: &'static Kind) -> Kind {
    List { of, min: 1, max: usize::MAX, unique: false }
}

/// A non-empty list of distinct elements.
const fn unique(of: &'static Kind) -> Kind {
    List { of, min: 1, max: usize::MAX, unique: true }
}

/// A list of exactly `count` elements.
const fn exactly(count: usize, of: &'static Kind) -> Kind {
    List { of, min: count, max: count, unique: false }
}

const fn object(object: &'static Object) -> Kind {
    Kind::Object(object)
}

pub(super) static ROOT: Object = Object {
    name: "the root",
    properties: &[
        need("asset", object(&ASSET)),
        may("extensionsUsed", unique(&Text)),
        may("extensionsRequired", unique(&Text)),
        may("scene", Index("scenes")),
        may("accessors", some(&object(&ACCESSOR))),
        may("animations", some(&object(&ANIMATION))),
        may("buffers", some(&object(&BUFFER))),
        may("bufferViews", some(&object(&VIEW))),
        may("cameras", some(&object(&CAMERA))),
        may("images", some(&object(&IMAGE))),
        may("materials", some(&object(&MATERIAL))),
        may("meshes", some(&object(&MESH))),
        may("nodes", some(&object(&NODE))),
        may("samplers", some(&object(&SAMPLER))),
        may("scenes", some(&object(&SCENE))),
        may("skins", some(&object(&SKIN))),
        may("textures", some(&object(&TEXTURE))),
    ],
};

static ASSET: Object = Object {
    name: "asset",
    properties: &[need("version", Text), may("minVersion", Text), may("generator", Text), may("copyright", Text)],
};

const COMPONENT: Kind = OneOf(&[5120, 5121, 5122, 5123, 5125, 5126]);
const INDEX_COMPONENT: Kind = OneOf(&[5121, 5123, 5125]);
const BOUND: Kind = List { of: &NUMBER, min: 1, max: 16, unique: false };

static ACCESSOR: Object = Object {
    name: "an accessor",
    properties: &[
        may("bufferView", Index("bufferViews")),
        may("byteOffset", OFFSET),
        need("componentType", COMPONENT),
        may("normalized", Bool),
        need("count", SIZE),
        need("type", Word(&["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"])),
        may("max", BOUND),
        may("min", BOUND),
        may("sparse", object(&SPARSE)),
        may("name", Text),
    ],
};

static SPARSE: Object = Object {
    name: "sparse",
    properties: &[
        need("count", SIZE),
        need("indices", object(&SPARSE_INDICES)),
        need("values", object(&SPARSE_VALUES)),
    ],
};

static SPARSE_INDICES: Object = Object {
    name: "sparse indices",
    properties: &[
        need("bufferView", Index("bufferViews")),
        may("byteOffset", OFFSET),
        need("componentType", INDEX_COMPONENT),
    ],
};

static SPARSE_VALUES: Object = Object {
    name: "sparse values",
    properties: &[need("bufferView", Index("bufferViews")), may("byteOffset", OFFSET)],
};

static BUFFER: Object =
    Object { name: "a buffer", properties: &[may("uri", Text), need("byteLength", SIZE), may("name", Text)] };

static VIEW: Object = Object {
    name: "a buffer view",
    properties: &[
        need("buffer", Index("buffers")),
        may("byteOffset", OFFSET),
        need("byteLength", SIZE),
        may("byteStride", Integer { min: 4, max: 252 }),
        may("target", OneOf(&[34962, 34963])),
        may("name", Text),
    ],
};

static ANIMATION: Object = Object {
    name: "an animation",
    properties: &[
        need("channels", some(&object(&CHANNEL))),
        need("samplers", some(&object(&ANIMATION_SAMPLER))),
        may("name", Text),
    ],
};

static CHANNEL: Object =
    Object { name: "a channel", properties: &[need("sampler", AnyIndex), need("target", object(&TARGET))] };

static TARGET: Object = Object {
    name: "a channel target",
    properties: &[may("node", Index("nodes")), need("path", Word(&["translation", "rotation", "scale", "weights"]))],
};

static ANIMATION_SAMPLER: Object = Object {
    name: "an animation sampler",
    properties: &[
        need("input", Index("accessors")),
        need("output", Index("accessors")),
        may("interpolation", Word(&["LINEAR", "STEP", "CUBICSPLINE"])),
    ],
};

static CAMERA: Object = Object {
    name: "a camera",
    properties: &[
        may("orthographic", object(&ORTHOGRAPHIC)),
        may("perspective", object(&PERSPECTIVE)),
        need("type", Word(&["perspective", "orthographic"])),
        may("name", Text),
    ],
};

static ORTHOGRAPHIC: Object = Object {
    name: "an orthographic camera",
    properties: &[need("xmag", NUMBER), need("ymag", NUMBER), need("zfar", POSITIVE), need("znear", NOT_NEGATIVE)],
};

static PERSPECTIVE: Object = Object {
    name: "a perspective camera",
    properties: &[may("aspectRatio", POSITIVE), need("yfov", POSITIVE), may("zfar", POSITIVE), need("znear", POSITIVE)],
};

static IMAGE: Object = Object {
    name: "an image",
    properties: &[
        may("uri", Text),
        may("mimeType", Word(&["image/jpeg", "image/png"])),
        may("bufferView", Index("bufferViews")),
        may("name", Text),
    ],
};

static MATERIAL: Object = Object {
    name: "a material",
    properties: &[
        may("pbrMetallicRoughness", object(&METAL_ROUGH)),
        may("normalTexture", object(&NORMAL_TEXTURE)),
        may("occlusionTexture", object(&OCCLUSION_TEXTURE)),
        may("emissiveTexture", object(&TEXTURE_INFO)),
        may("emissiveFactor", exactly(3, &UNIT)),
        may("alphaMode", Word(&["OPAQUE", "MASK", "BLEND"])),
        may("alphaCutoff", NOT_NEGATIVE),
        may("doubleSided", Bool),
        may("name", Text),
    ],
};

static METAL_ROUGH: Object = Object {
    name: "pbrMetallicRoughness",
    properties: &[
        may("baseColorFactor", exactly(4, &UNIT)),
        may("baseColorTexture", object(&TEXTURE_INFO)),
        may("metallicFactor", UNIT),
        may("roughnessFactor", UNIT),
        may("metallicRoughnessTexture", object(&TEXTURE_INFO)),
    ],
};

static TEXTURE_INFO: Object =
    Object { name: "a texture slot", properties: &[need("index", Index("textures")), may("texCoord", SET)] };

static NORMAL_TEXTURE: Object = Object {
    name: "a texture slot",
    properties: &[need("index", Index("textures")), may("texCoord", SET), may("scale", NUMBER)],
};

static OCCLUSION_TEXTURE: Object = Object {
    name: "a texture slot",
    properties: &[need("index", Index("textures")), may("texCoord", SET), may("strength", UNIT)],
};

static MESH: Object = Object {
    name: "a mesh",
    properties: &[need("primitives", some(&object(&PRIMITIVE))), may("weights", some(&NUMBER)), may("name", Text)],
};

static PRIMITIVE: Object = Object {
    name: "a primitive",
    properties: &[
        need("attributes", Map(&Index("accessors"))),
        may("indices", Index("accessors")),
        may("material", Index("materials")),
        may("mode", OneOf(&[0, 1, 2, 3, 4, 5, 6])),
        may("targets", some(&Map(&Index("accessors")))),
    ],
};

static NODE: Object = Object {
    name: "a node",
    properties: &[
        may("camera", Index("cameras")),
        may("children", unique(&Index("nodes"))),
        may("skin", Index("skins")),
        may("matrix", exactly(16, &NUMBER)),
        may("mesh", Index("meshes")),
        may("rotation", exactly(4, &Number(Range { min: -1.0, max: 1.0, open: false }))),
        may("scale", exactly(3, &NUMBER)),
        may("translation", exactly(3, &NUMBER)),
        may("weights", some(&NUMBER)),
        may("name", Text),
    ],
};

const WRAP: Kind = OneOf(&[33071, 33648, 10497]);

static SAMPLER: Object = Object {
    name: "a sampler",
    properties: &[
        may("magFilter", OneOf(&[9728, 9729])),
        may("minFilter", OneOf(&[9728, 9729, 9984, 9985, 9986, 9987])),
        may("wrapS", WRAP),
        may("wrapT", WRAP),
        may("name", Text),
    ],
};

static SCENE: Object =
    Object { name: "a scene", properties: &[may("nodes", unique(&Index("nodes"))), may("name", Text)] };

static SKIN: Object = Object {
    name: "a skin",
    properties: &[
        may("inverseBindMatrices", Index("accessors")),
        may("skeleton", Index("nodes")),
        need("joints", unique(&Index("nodes"))),
        may("name", Text),
    ],
};

static TEXTURE: Object = Object {
    name: "a texture",
    properties: &[may("sampler", Index("samplers")), may("source", Index("images")), may("name", Text)],
};

/// Words that extensions allow in addition to those of the core.
pub(super) static EXTENSION_WORDS: &[(&str, &str)] = &[
    ("image/avif", "EXT_texture_avif"),
    ("image/ktx2", "KHR_texture_basisu"),
    ("image/vnd-ms.dds", "MSFT_texture_dds"),
    ("image/webp", "EXT_texture_webp"),
    ("pointer", "KHR_animation_pointer"),
];

/// Rules for the supported extensions.
pub(super) static EXTENSIONS: &[Extension] = &[
    Extension { name: "EXT_mesh_gpu_instancing", on: &["a node"], object: &INSTANCING },
    Extension { name: "EXT_meshopt_compression", on: &["a buffer"], object: &MESHOPT_BUFFER },
    Extension { name: "EXT_meshopt_compression", on: &["a buffer view"], object: &MESHOPT },
    Extension { name: "EXT_texture_webp", on: &["a texture"], object: &TEXTURE_SOURCE },
    Extension { name: "KHR_animation_pointer", on: &["a channel target"], object: &POINTER },
    Extension { name: "KHR_draco_mesh_compression", on: &["a primitive"], object: &DRACO },
    Extension { name: "KHR_lights_punctual", on: &["the root"], object: &LIGHTS },
    Extension { name: "KHR_lights_punctual", on: &["a node"], object: &LIGHT_REFERENCE },
    Extension { name: "KHR_materials_anisotropy", on: &["a material"], object: &ANISOTROPY },
    Extension { name: "KHR_materials_clearcoat", on: &["a material"], object: &CLEARCOAT },
    Extension { name: "KHR_materials_diffuse_transmission", on: &["a material"], object: &DIFFUSE_TRANSMISSION },
    Extension { name: "KHR_materials_dispersion", on: &["a material"], object: &DISPERSION },
    Extension { name: "KHR_materials_emissive_strength", on: &["a material"], object: &EMISSIVE_STRENGTH },
    Extension { name: "KHR_materials_ior", on: &["a material"], object: &IOR },
    Extension { name: "KHR_materials_iridescence", on: &["a material"], object: &IRIDESCENCE },
    Extension { name: "KHR_materials_pbrSpecularGlossiness", on: &["a material"], object: &SPECULAR_GLOSSINESS },
    Extension { name: "KHR_materials_sheen", on: &["a material"], object: &SHEEN },
    Extension { name: "KHR_materials_specular", on: &["a material"], object: &SPECULAR },
    Extension { name: "KHR_materials_transmission", on: &["a material"], object: &TRANSMISSION },
    Extension { name: "KHR_materials_unlit", on: &["a material"], object: &EMPTY },
    Extension { name: "KHR_materials_variants", on: &["the root"], object: &VARIANTS },
    Extension { name: "KHR_materials_variants", on: &["a primitive"], object: &VARIANT_MAPPINGS },
    Extension { name: "KHR_materials_volume", on: &["a material"], object: &VOLUME },
    Extension { name: "KHR_mesh_quantization", on: &[], object: &EMPTY },
    Extension { name: "KHR_meshopt_compression", on: &["a buffer"], object: &MESHOPT_BUFFER },
    Extension { name: "KHR_meshopt_compression", on: &["a buffer view"], object: &MESHOPT },
    Extension { name: "KHR_node_visibility", on: &["a node"], object: &VISIBILITY },
    Extension { name: "KHR_texture_basisu", on: &["a texture"], object: &TEXTURE_SOURCE },
    Extension { name: "KHR_texture_transform", on: &["a texture slot"], object: &TEXTURE_TRANSFORM },
    Extension { name: "MSFT_texture_dds", on: &["a texture"], object: &TEXTURE_SOURCE },
];

static EMPTY: Object = Object { name: "an extension", properties: &[] };

static INSTANCING: Object = Object { name: "an extension", properties: &[may("attributes", Map(&Index("accessors")))] };

static TEXTURE_SOURCE: Object = Object { name: "an extension", properties: &[may("source", Index("images"))] };

static POINTER: Object = Object { name: "an extension", properties: &[need("pointer", Text)] };

static DRACO: Object = Object {
    name: "an extension",
    properties: &[need("bufferView", Index("bufferViews")), need("attributes", Map(&OFFSET))],
};

static MESHOPT_BUFFER: Object = Object { name: "an extension", properties: &[may("fallback", Bool)] };

/// Sizes and modes are checked where streams are decoded.
static MESHOPT: Object = Object {
    name: "an extension",
    properties: &[
        need("buffer", Index("buffers")),
        may("byteOffset", OFFSET),
        need("byteLength", SIZE),
        need("byteStride", SIZE),
        need("count", SIZE),
        need("mode", Text),
        may("filter", Text),
    ],
};

static LIGHTS: Object = Object { name: "an extension", properties: &[need("lights", some(&object(&LIGHT)))] };

static LIGHT: Object = Object {
    name: "a light",
    properties: &[
        may("color", exactly(3, &UNIT)),
        may("intensity", NOT_NEGATIVE),
        need("type", Word(&["directional", "point", "spot"])),
        may("spot", object(&SPOT)),
        may("range", POSITIVE),
        may("name", Text),
    ],
};

static SPOT: Object = Object {
    name: "a spot",
    properties: &[
        may("innerConeAngle", Number(Range { min: 0.0, max: std::f64::consts::FRAC_PI_2, open: false })),
        may("outerConeAngle", Number(Range { min: 0.0, max: std::f64::consts::FRAC_PI_2, open: true })),
    ],
};

static LIGHT_REFERENCE: Object =
    Object { name: "an extension", properties: &[need("light", Index("KHR_lights_punctual"))] };

static ANISOTROPY: Object = Object {
    name: "an extension",
    properties: &[
        may("anisotropyStrength", UNIT),
        may("anisotropyRotation", NUMBER),
        may("anisotropyTexture", object(&TEXTURE_INFO)),
    ],
};

static CLEARCOAT: Object = Object {
    name: "an extension",
    properties: &[
        may("clearcoatFactor", UNIT),
        may("clearcoatTexture", object(&TEXTURE_INFO)),
        may("clearcoatRoughnessFactor", UNIT),
        may("clearcoatRoughnessTexture", object(&TEXTURE_INFO)),
        may("clearcoatNormalTexture", object(&NORMAL_TEXTURE)),
    ],
};

static DISPERSION: Object = Object { name: "an extension", properties: &[may("dispersion", NOT_NEGATIVE)] };

static EMISSIVE_STRENGTH: Object =
    Object { name: "an extension", properties: &[may("emissiveStrength", NOT_NEGATIVE)] };

/// At least 1, or 0 as a special case of the extension; the range does not exclude numbers between.
static IOR: Object = Object { name: "an extension", properties: &[may("ior", NOT_NEGATIVE)] };

static IRIDESCENCE: Object = Object {
    name: "an extension",
    properties: &[
        may("iridescenceFactor", UNIT),
        may("iridescenceTexture", object(&TEXTURE_INFO)),
        may("iridescenceIor", Number(Range { min: 1.0, max: INF, open: false })),
        may("iridescenceThicknessMinimum", NOT_NEGATIVE),
        may("iridescenceThicknessMaximum", NOT_NEGATIVE),
        may("iridescenceThicknessTexture", object(&TEXTURE_INFO)),
    ],
};

static SPECULAR_GLOSSINESS: Object = Object {
    name: "an extension",
    properties: &[
        may("diffuseFactor", exactly(4, &UNIT)),
        may("diffuseTexture", object(&TEXTURE_INFO)),
        may("specularFactor", exactly(3, &UNIT)),
        may("glossinessFactor", UNIT),
        may("specularGlossinessTexture", object(&TEXTURE_INFO)),
    ],
};

static DIFFUSE_TRANSMISSION: Object = Object {
    name: "an extension",
    properties: &[
        may("diffuseTransmissionFactor", UNIT),
        may("diffuseTransmissionTexture", object(&TEXTURE_INFO)),
        may("diffuseTransmissionColorFactor", exactly(3, &UNIT)),
        may("diffuseTransmissionColorTexture", object(&TEXTURE_INFO)),
    ],
};

static SHEEN: Object = Object {
    name: "an extension",
    properties: &[
        may("sheenColorFactor", exactly(3, &UNIT)),
        may("sheenColorTexture", object(&TEXTURE_INFO)),
        may("sheenRoughnessFactor", UNIT),
        may("sheenRoughnessTexture", object(&TEXTURE_INFO)),
    ],
};

static SPECULAR: Object = Object {
    name: "an extension",
    properties: &[
        may("specularFactor", UNIT),
        may("specularTexture", object(&TEXTURE_INFO)),
        may("specularColorFactor", exactly(3, &NOT_NEGATIVE)),
        may("specularColorTexture", object(&TEXTURE_INFO)),
    ],
};

static TRANSMISSION: Object = Object {
    name: "an extension",
    properties: &[may("transmissionFactor", UNIT), may("transmissionTexture", object(&TEXTURE_INFO))],
};

static VARIANTS: Object = Object { name: "an extension", properties: &[need("variants", some(&object(&VARIANT)))] };

static VARIANT: Object = Object { name: "a variant", properties: &[need("name", Text)] };

static VARIANT_MAPPINGS: Object =
    Object { name: "an extension", properties: &[need("mappings", some(&object(&VARIANT_MAPPING)))] };

static VARIANT_MAPPING: Object = Object {
    name: "a variant mapping",
    properties: &[
        need("variants", unique(&Index("KHR_materials_variants"))),
        need("material", Index("materials")),
        may("name", Any),
    ],
};

static VOLUME: Object = Object {
    name: "an extension",
    properties: &[
        may("thicknessFactor", NOT_NEGATIVE),
        may("thicknessTexture", object(&TEXTURE_INFO)),
        may("attenuationDistance", POSITIVE),
        may("attenuationColor", exactly(3, &UNIT)),
    ],
};

static VISIBILITY: Object = Object { name: "an extension", properties: &[may("visible", Bool)] };

static TEXTURE_TRANSFORM: Object = Object {
    name: "an extension",
    properties: &[
        may("offset", exactly(2, &NUMBER)),
        may("rotation", NUMBER),
        may("scale", exactly(2, &NUMBER)),
        may("texCoord", SET),
    ],
};
