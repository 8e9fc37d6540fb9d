//! Verdict on each fault: one row for every code of the Khronos glTF validator that concerns rendering.
//!
//! The rule behind the rows: **refuse** when it is unknown what the file shows (it is not glTF 2.0, a required part is missing,
//! an index is out of range); **warn** when a rule is broken but the rendering is clear, or when a part can be left out;
//! **accept** silently what changes nothing. Faults are at most warnings in animations, as nodes can be drawn at rest; in
//! images, as a material can be drawn without a map; in cameras, as there is always another view; and in declared bounds, which
//! rendering does not use ([`Code::verdict_at`]). In materials, textures, samplers, lights and names, properties that break the
//! schema are left out (`mend`).

use crate::load::diagnostic::{CUT_OFF, DAMAGED};
use std::sync::LazyLock;

/// Consequence of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The file is not drawn.
    Refuse,
    /// The file is drawn, with a warning.
    Warn,
    /// The file is drawn without a warning.
    Accept,
}

/// One row of the table.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Name of the code in the Khronos validator.
    pub khronos: &'static str,
    /// Consequence of the fault.
    pub verdict: Verdict,
    /// Reason, in a phrase.
    pub why: &'static str,
}

macro_rules! codes {
    ($($code:ident $khronos:literal $verdict:ident $why:literal;)*) => {
        /// A kind of fault, named as the Khronos validator names it.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[expect(missing_docs, reason = "each is explained by its row in the table")]
        pub enum Code { $($code),* }

        #[cfg(test)]
        const NAMES_OF_CODES: &[&str] = &[$(stringify!($code)),*];

        /// Every row, in the order of [`Code`].
        pub const TABLE: &[Row] = &[$(Row { khronos: $khronos, verdict: Verdict::$verdict, why: $why }),*];
    };
}

codes! {
    // Container and JSON.
    GlbInvalidMagic "GLB_INVALID_MAGIC" Refuse "not a GLB file";
    GlbInvalidVersion "GLB_INVALID_VERSION" Refuse "only container version 2 holds glTF 2.0";
    GlbLengthTooSmall "GLB_LENGTH_TOO_SMALL" Refuse "there is no room for a scene";
    GlbLengthMismatch "GLB_LENGTH_MISMATCH" Warn "what is there is read";
    GlbUnexpectedEndOfHeader "GLB_UNEXPECTED_END_OF_HEADER" Refuse "the file was cut off";
    GlbUnexpectedEndOfChunkHeader "GLB_UNEXPECTED_END_OF_CHUNK_HEADER" Refuse "the file was cut off";
    GlbUnexpectedEndOfChunkData "GLB_UNEXPECTED_END_OF_CHUNK_DATA" Refuse "the JSON was cut off; of binary data what is there is read";
    GlbChunkTooBig "GLB_CHUNK_TOO_BIG" Refuse "where the JSON ends is unknown; of binary data what is there is read";
    GlbChunkLengthUnaligned "GLB_CHUNK_LENGTH_UNALIGNED" Warn "the chunk can be read as it is";
    GlbEmptyChunk "GLB_EMPTY_CHUNK" Warn "an empty chunk holds nothing to miss";
    GlbEmptyBinChunk "GLB_EMPTY_BIN_CHUNK" Accept "an empty chunk holds nothing to miss";
    GlbDuplicateChunk "GLB_DUPLICATE_CHUNK" Warn "the first one counts";
    GlbUnexpectedFirstChunk "GLB_UNEXPECTED_FIRST_CHUNK" Refuse "where the JSON is, is unknown";
    GlbUnexpectedBinChunk "GLB_UNEXPECTED_BIN_CHUNK" Warn "it is found wherever it stands";
    GlbUnknownChunkType "GLB_UNKNOWN_CHUNK_TYPE" Accept "unknown chunks are to be skipped";
    GlbExtraData "GLB_EXTRA_DATA" Warn "bytes after the last chunk are not read";
    InvalidJson "INVALID_JSON" Refuse "nothing can be known; a byte-order mark, and names that are not UTF-8, are warned about";
    IoError "IO_ERROR" Refuse "geometry is missing; a missing image is a warning";

    // Shape of the JSON.
    ArrayLengthNotInList "ARRAY_LENGTH_NOT_IN_LIST" Refuse "which numbers are meant is unknown";
    ArrayTypeMismatch "ARRAY_TYPE_MISMATCH" Refuse "what is meant is unknown";
    DuplicateElements "DUPLICATE_ELEMENTS" Warn "the second says nothing new";
    EmptyEntity "EMPTY_ENTITY" Warn "exporters write empty lists for nothing";
    InvalidIndex "INVALID_INDEX" Refuse "what is referred to is unknown";
    InvalidUri "INVALID_URI" Refuse "the data cannot be found";
    OneOfMismatch "ONE_OF_MISMATCH" Refuse "which of them counts is unknown";
    PatternMismatch "PATTERN_MISMATCH" Refuse "the version decides how everything else is read; 2 and 2.0.1 are clear enough";
    TypeMismatch "TYPE_MISMATCH" Refuse "what is meant is unknown";
    UndefinedProperty "UNDEFINED_PROPERTY" Refuse "a part that everything else hangs on is missing";
    UnexpectedProperty "UNEXPECTED_PROPERTY" Accept "unknown properties are to be skipped";
    ExtraProperty "EXTRA_PROPERTY" Accept "it is not used";
    UnsatisfiedDependency "UNSATISFIED_DEPENDENCY" Warn "the lonely property is left out";
    ValueMultipleOf "VALUE_MULTIPLE_OF" Warn "unaligned data can be read";
    ValueNotInList "VALUE_NOT_IN_LIST" Warn "the default is taken, or the object left out";
    ValueNotInRange "VALUE_NOT_IN_RANGE" Warn "a factor is taken as the nearest allowed value; what cannot be used otherwise is left out or refused";
    NonObjectExtras "NON_OBJECT_EXTRAS" Accept "extras are not read";

    // Version and extensions.
    AssetMinVersionGreaterThanVersion "ASSET_MIN_VERSION_GREATER_THAN_VERSION" Warn "minVersion decides";
    UnknownAssetMajorVersion "UNKNOWN_ASSET_MAJOR_VERSION" Refuse "only glTF 2 is understood";
    UnknownAssetMinorVersion "UNKNOWN_ASSET_MINOR_VERSION" Warn "2.x is meant to be readable as 2.0";
    InvalidExtensionNameFormat "INVALID_EXTENSION_NAME_FORMAT" Accept "a name is a name";
    UndeclaredExtension "UNDECLARED_EXTENSION" Warn "the extension is read all the same";
    UnexpectedExtensionObject "UNEXPECTED_EXTENSION_OBJECT" Warn "it means nothing there and is skipped";
    UnsupportedExtension "UNSUPPORTED_EXTENSION" Accept "told by our own list of what changes the look";
    IncompleteExtensionSupport "INCOMPLETE_EXTENSION_SUPPORT" Accept "told by our own list of what changes the look";
    UnusedExtensionRequired "UNUSED_EXTENSION_REQUIRED" Warn "what is required counts as used";
    NonRequiredExtension "NON_REQUIRED_EXTENSION" Warn "we know it, required or not";
    MultipleExtensions "MULTIPLE_EXTENSIONS" Accept "unlit counts first, then specular-glossiness";

    // Buffers, views, accessors.
    BufferDataUriMimeTypeInvalid "BUFFER_DATA_URI_MIME_TYPE_INVALID" Warn "the bytes are read all the same";
    BufferByteLengthMismatch "BUFFER_BYTE_LENGTH_MISMATCH" Warn "what is there is read";
    BufferGlbChunkTooBig "BUFFER_GLB_CHUNK_TOO_BIG" Accept "padding is not read";
    BufferMissingGlbData "BUFFER_MISSING_GLB_DATA" Refuse "geometry is missing";
    BufferViewInvalidByteStride "BUFFER_VIEW_INVALID_BYTE_STRIDE" Warn "the stride is ignored where it means nothing";
    BufferViewTooBigByteStride "BUFFER_VIEW_TOO_BIG_BYTE_STRIDE" Warn "one element can still be read";
    BufferViewTooLong "BUFFER_VIEW_TOO_LONG" Refuse "data is missing";
    BufferViewTargetMissing "BUFFER_VIEW_TARGET_MISSING" Accept "targets are hints for GPUs";
    BufferViewTargetOverride "BUFFER_VIEW_TARGET_OVERRIDE" Warn "targets are hints for GPUs";
    NonRelativeUri "NON_RELATIVE_URI" Warn "nothing is fetched; refused where geometry needs it";
    UriGlb "URI_GLB" Accept "a GLB may name files";
    DataUriGlb "DATA_URI_GLB" Accept "only longer than need be";
    AccessorMatrixAlignment "ACCESSOR_MATRIX_ALIGNMENT" Warn "unaligned data can be read";
    AccessorNormalizedInvalid "ACCESSOR_NORMALIZED_INVALID" Warn "floats need no normalising";
    AccessorOffsetAlignment "ACCESSOR_OFFSET_ALIGNMENT" Warn "unaligned data can be read";
    AccessorTotalOffsetAlignment "ACCESSOR_TOTAL_OFFSET_ALIGNMENT" Warn "unaligned data can be read";
    AccessorSmallByteStride "ACCESSOR_SMALL_BYTESTRIDE" Warn "overlapping elements can be read";
    AccessorTooLong "ACCESSOR_TOO_LONG" Refuse "data is missing";
    AccessorUsageOverride "ACCESSOR_USAGE_OVERRIDE" Warn "data can be read twice";
    AccessorSparseCountOutOfRange "ACCESSOR_SPARSE_COUNT_OUT_OF_RANGE" Refuse "it changes more than there is";
    AccessorSparseIndexOob "ACCESSOR_SPARSE_INDEX_OOB" Refuse "it changes what is not there";
    AccessorSparseIndicesNonIncreasing "ACCESSOR_SPARSE_INDICES_NON_INCREASING" Warn "the last one counts";
    AccessorMinMismatch "ACCESSOR_MIN_MISMATCH" Warn "bounds are computed from the data";
    AccessorMaxMismatch "ACCESSOR_MAX_MISMATCH" Warn "bounds are computed from the data";
    AccessorElementOutOfMinBound "ACCESSOR_ELEMENT_OUT_OF_MIN_BOUND" Warn "bounds are computed from the data";
    AccessorElementOutOfMaxBound "ACCESSOR_ELEMENT_OUT_OF_MAX_BOUND" Warn "bounds are computed from the data";

    // Data of meshes.
    AccessorInvalidFloat "ACCESSOR_INVALID_FLOAT" Warn "faces with such corners are left out";
    AccessorIndexOob "ACCESSOR_INDEX_OOB" Refuse "most often the sign of a wrong or damaged buffer";
    AccessorIndexPrimitiveRestart "ACCESSOR_INDEX_PRIMITIVE_RESTART" Refuse "no vertex has that index; where one has, it is drawn with a warning";
    AccessorIndexTriangleDegenerate "ACCESSOR_INDEX_TRIANGLE_DEGENERATE" Accept "told as dropped faces";
    AccessorVector3NonUnit "ACCESSOR_VECTOR3_NON_UNIT" Warn "normals and tangents are made unit";
    AccessorInvalidSign "ACCESSOR_INVALID_SIGN" Warn "only the sign of w counts";
    AccessorNonClamped "ACCESSOR_NON_CLAMPED" Warn "colours are clamped to 0…1";
    AccessorInvalidIbm "ACCESSOR_INVALID_IBM" Warn "the last row is taken as 0 0 0 1";
    AccessorJointsIndexDuplicate "ACCESSOR_JOINTS_INDEX_DUPLICATE" Accept "weights of one joint add up";
    AccessorJointsIndexOob "ACCESSOR_JOINTS_INDEX_OOB" Warn "that influence is left out";
    AccessorJointsUsedZeroWeight "ACCESSOR_JOINTS_USED_ZERO_WEIGHT" Accept "it has no influence";
    AccessorWeightsNegative "ACCESSOR_WEIGHTS_NEGATIVE" Warn "taken as zero";
    AccessorWeightsNonNormalized "ACCESSOR_WEIGHTS_NON_NORMALIZED" Warn "weights are made to sum to one";

    // Meshes.
    MeshInvalidWeightsCount "MESH_INVALID_WEIGHTS_COUNT" Warn "weights that are missing are zero";
    MeshPrimitiveAccessorUnaligned "MESH_PRIMITIVE_ACCESSOR_UNALIGNED" Warn "unaligned data can be read";
    MeshPrimitiveAccessorWithoutByteStride "MESH_PRIMITIVE_ACCESSOR_WITHOUT_BYTESTRIDE" Warn "elements are taken as packed";
    MeshPrimitiveAttributesAccessorInvalidFormat "MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_INVALID_FORMAT" Refuse
        "positions cannot be read; other attributes are left out with a warning";
    MeshPrimitiveAttributesAccessorUnsignedInt "MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_UNSIGNED_INT" Warn "the attribute is left out";
    MeshPrimitiveIncompatibleMode "MESH_PRIMITIVE_INCOMPATIBLE_MODE" Warn "corners left over make no face";
    MeshPrimitiveIndexedSemanticContinuity "MESH_PRIMITIVE_INDEXED_SEMANTIC_CONTINUITY" Warn "sets are found by their number";
    MeshPrimitiveIndicesAccessorInvalidFormat "MESH_PRIMITIVE_INDICES_ACCESSOR_INVALID_FORMAT" Refuse "faces cannot be read";
    MeshPrimitiveIndicesAccessorWithByteStride "MESH_PRIMITIVE_INDICES_ACCESSOR_WITH_BYTESTRIDE" Warn "read with that stride";
    MeshPrimitiveInvalidAttribute "MESH_PRIMITIVE_INVALID_ATTRIBUTE" Warn "the attribute is left out";
    MeshPrimitiveJointsWeightsMismatch "MESH_PRIMITIVE_JOINTS_WEIGHTS_MISMATCH" Warn "only whole pairs count";
    MeshPrimitiveMorphTargetInvalidAttributeCount "MESH_PRIMITIVE_MORPH_TARGET_INVALID_ATTRIBUTE_COUNT" Warn
        "that attribute of the target is left out";
    MeshPrimitiveMorphTargetNoBaseAccessor "MESH_PRIMITIVE_MORPH_TARGET_NO_BASE_ACCESSOR" Warn
        "that attribute of the target is left out";
    MeshPrimitiveNoPosition "MESH_PRIMITIVE_NO_POSITION" Warn "the primitive is left out";
    MeshPrimitivePositionAccessorWithoutBounds "MESH_PRIMITIVE_POSITION_ACCESSOR_WITHOUT_BOUNDS" Warn
        "bounds are computed from the data";
    MeshPrimitiveTangentWithoutNormal "MESH_PRIMITIVE_TANGENT_WITHOUT_NORMAL" Warn "such tangents are to be ignored";
    MeshPrimitiveGeneratedTangentSpace "MESH_PRIMITIVE_GENERATED_TANGENT_SPACE" Accept "MikkTSpace is what the format asks for";
    MeshPrimitiveNoTangentSpace "MESH_PRIMITIVE_NO_TANGENT_SPACE" Warn "they are made from its texture coordinates";
    MeshPrimitiveTooFewTexcoords "MESH_PRIMITIVE_TOO_FEW_TEXCOORDS" Warn "the map is read at (0, 0)";
    MeshPrimitiveUnequalAccessorCount "MESH_PRIMITIVE_UNEQUAL_ACCESSOR_COUNT" Warn "the attribute is left out";
    MeshPrimitivesUnequalTargetsCount "MESH_PRIMITIVES_UNEQUAL_TARGETS_COUNT" Warn "targets that are missing change nothing";
    UnusedMeshTangent "UNUSED_MESH_TANGENT" Accept "not read";
    UnusedMeshWeights "UNUSED_MESH_WEIGHTS" Accept "the node's weights count";

    // Nodes, scenes, skins.
    NodeEmpty "NODE_EMPTY" Accept "nothing to draw";
    NodeLoop "NODE_LOOP" Refuse "a loop has no picture";
    NodeMatrixDefault "NODE_MATRIX_DEFAULT" Accept "only longer than need be";
    NodeMatrixNonTrs "NODE_MATRIX_NON_TRS" Warn "a shear can be drawn";
    NodeMatrixTrs "NODE_MATRIX_TRS" Warn "the matrix counts";
    NodeParentOverride "NODE_PARENT_OVERRIDE" Refuse "where the node stands is unknown";
    NodeSkinNoScene "NODE_SKIN_NO_SCENE" Warn "joints have a place without a scene";
    NodeSkinWithNonSkinnedMesh "NODE_SKIN_WITH_NON_SKINNED_MESH" Warn "drawn without the skin";
    NodeSkinnedMeshLocalTransforms "NODE_SKINNED_MESH_LOCAL_TRANSFORMS" Accept "they are to be ignored";
    NodeSkinnedMeshNonRoot "NODE_SKINNED_MESH_NON_ROOT" Accept "its parents are to be ignored";
    NodeSkinnedMeshWithoutSkin "NODE_SKINNED_MESH_WITHOUT_SKIN" Accept "drawn as an ordinary mesh";
    NodeWeightsInvalid "NODE_WEIGHTS_INVALID" Warn "weights that are missing are zero";
    RotationNonUnit "ROTATION_NON_UNIT" Warn "the rotation is made unit";
    SceneNonRootNode "SCENE_NON_ROOT_NODE" Warn "drawn from that node on";
    InvalidIbmAccessorCount "INVALID_IBM_ACCESSOR_COUNT" Warn "drawn without the skin";
    SkinIbmAccessorWithByteStride "SKIN_IBM_ACCESSOR_WITH_BYTESTRIDE" Warn "read with that stride";
    SkinIbmInvalidFormat "SKIN_IBM_INVALID_FORMAT" Warn "drawn without the skin";
    SkinNoCommonRoot "SKIN_NO_COMMON_ROOT" Warn "joints have a place of their own";
    SkinSkeletonInvalid "SKIN_SKELETON_INVALID" Warn "the hint is not used";
    UnresolvedReference "UNRESOLVED_REFERENCE" Refuse "what is referred to is not there";
    UnusedObject "UNUSED_OBJECT" Accept "what is not drawn costs nothing";

    // Cameras, lights, materials, images.
    CameraXmagYmagNegative "CAMERA_XMAG_YMAG_NEGATIVE" Accept "its size counts";
    CameraXmagYmagZero "CAMERA_XMAG_YMAG_ZERO" Warn "the camera is left out";
    CameraYfovGequalPi "CAMERA_YFOV_GEQUAL_PI" Warn "the camera is left out";
    CameraZfarLequalZnear "CAMERA_ZFAR_LEQUAL_ZNEAR" Warn "clipping planes are not used";
    LightSpotAngles "KHR_LIGHTS_PUNCTUAL_LIGHT_SPOT_ANGLES" Warn "the inner angle is taken as the outer one";
    MaterialAlphaCutoffInvalidMode "MATERIAL_ALPHA_CUTOFF_INVALID_MODE" Accept "the cutoff is to be ignored";
    ImageBufferViewWithByteStride "IMAGE_BUFFER_VIEW_WITH_BYTESTRIDE" Warn "the bytes are read in a row";
    ImageDataInvalid "IMAGE_DATA_INVALID" Warn "the material is drawn without it";
    ImageFeaturesUnsupported "IMAGE_FEATURES_UNSUPPORTED" Accept "they are to be ignored";
    ImageMimeTypeInvalid "IMAGE_MIME_TYPE_INVALID" Warn "the bytes decide";
    ImageNonEnabledMimeType "IMAGE_NON_ENABLED_MIME_TYPE" Warn "the bytes decide";
    ImageNpotDimensions "IMAGE_NPOT_DIMENSIONS" Accept "any size is fine";
    ImageUnexpectedEos "IMAGE_UNEXPECTED_EOS" Warn "the material is drawn without it";
    ImageUnrecognizedFormat "IMAGE_UNRECOGNIZED_FORMAT" Warn "the material is drawn without it";
    TextureInvalidImageMimeType "TEXTURE_INVALID_IMAGE_MIME_TYPE" Warn "the bytes decide";
    AnisotropyTexcoord "KHR_MATERIALS_ANISOTROPY_ANISOTROPY_TEXTURE_TEXCOORD" Accept "each map has coordinates of its own";
    ClearcoatTexcoord "KHR_MATERIALS_CLEARCOAT_CLEARCOAT_NORMAL_TEXTURE_TEXCOORD" Accept "each map has coordinates of its own";
    DispersionNoVolume "KHR_MATERIALS_DISPERSION_NO_VOLUME" Accept "thin glass does not bend light";
    EmissiveStrengthZeroFactor "KHR_MATERIALS_EMISSIVE_STRENGTH_ZERO_FACTOR" Accept "nothing glows";
    IridescenceRangeWithoutTexture "KHR_MATERIALS_IRIDESCENCE_THICKNESS_RANGE_WITHOUT_TEXTURE" Accept "the greatest thickness is taken";
    IridescenceTextureUnused "KHR_MATERIALS_IRIDESCENCE_THICKNESS_TEXTURE_UNUSED" Accept "without iridescence its thickness shows nothing";
    VolumeDoubleSided "KHR_MATERIALS_VOLUME_DOUBLE_SIDED" Accept "both sides are drawn";
    VolumeNoTransmission "KHR_MATERIALS_VOLUME_NO_TRANSMISSION" Accept "no light gets in";
    VariantsNonUnique "KHR_MATERIALS_VARIANTS_NON_UNIQUE_VARIANT" Accept "the first mapping counts, and is told where the variant is asked for";

    // Animations: checked only when played; faults are reported then.
    AccessorAnimationInputNegative "ACCESSOR_ANIMATION_INPUT_NEGATIVE" Accept "it has begun before 0";
    AccessorAnimationInputNonIncreasing "ACCESSOR_ANIMATION_INPUT_NON_INCREASING" Accept "told when it is played";
    AccessorAnimationQuaternion "ACCESSOR_ANIMATION_SAMPLER_OUTPUT_NON_NORMALIZED_QUATERNION" Accept "the rotation is made unit";
    AnimationTargetMatrix "ANIMATION_CHANNEL_TARGET_NODE_MATRIX" Accept "told when it is played";
    AnimationTargetSkin "ANIMATION_CHANNEL_TARGET_NODE_SKIN" Accept "its joints place the mesh";
    AnimationTargetNoMorphs "ANIMATION_CHANNEL_TARGET_NODE_WEIGHTS_NO_MORPHS" Accept "told when it is played";
    AnimationDuplicateTargets "ANIMATION_DUPLICATE_TARGETS" Accept "told when it is played";
    AnimationByteStride "ANIMATION_SAMPLER_ACCESSOR_WITH_BYTESTRIDE" Accept "read with that stride";
    AnimationInputFormat "ANIMATION_SAMPLER_INPUT_ACCESSOR_INVALID_FORMAT" Accept "told when it is played";
    AnimationInputFew "ANIMATION_SAMPLER_INPUT_ACCESSOR_TOO_FEW_ELEMENTS" Accept "one key holds for all times";
    AnimationInputBounds "ANIMATION_SAMPLER_INPUT_ACCESSOR_WITHOUT_BOUNDS" Accept "the end is found in the data";
    AnimationOutputCount "ANIMATION_SAMPLER_OUTPUT_ACCESSOR_INVALID_COUNT" Accept "told when it is played";
    AnimationOutputFormat "ANIMATION_SAMPLER_OUTPUT_ACCESSOR_INVALID_FORMAT" Accept "told when it is played";
    AnimationPointerNode "KHR_ANIMATION_POINTER_ANIMATION_CHANNEL_TARGET_NODE" Accept "told when it is played";
    AnimationPointerPath "KHR_ANIMATION_POINTER_ANIMATION_CHANNEL_TARGET_PATH" Accept "told when it is played";
}

/// Our names, `gltf-unresolved-reference` and so on, in the order of [`TABLE`].
static NAMES: LazyLock<Vec<String>> = LazyLock::new(|| {
    TABLE.iter().map(|row| format!("gltf-{}", row.khronos.to_lowercase().replace('_', "-"))).collect()
});

impl Code {
    /// Row of the code in the table.
    pub fn row(self) -> &'static Row {
        &TABLE[self as usize]
    }

    /// Our name of the code in messages.
    pub fn name(self) -> &'static str {
        &NAMES[self as usize]
    }

    /// Remedy where the code refuses a file.
    pub fn remedy(self) -> &'static str {
        match self {
            Self::GlbLengthTooSmall
            | Self::GlbUnexpectedEndOfHeader
            | Self::GlbUnexpectedEndOfChunkHeader
            | Self::GlbUnexpectedEndOfChunkData
            | Self::GlbChunkTooBig
            | Self::BufferMissingGlbData => CUT_OFF,
            Self::GlbInvalidVersion | Self::PatternMismatch | Self::UnknownAssetMajorVersion => {
                "convert it to glTF 2.0 (gltf-pipeline, Blender)"
            }
            Self::InvalidUri => "name the file by a relative path, or export it as .glb",
            Self::NodeLoop => "take it out of the children of what it holds",
            Self::NodeParentOverride => "take the node out of all lists of children but one",
            Self::AccessorIndexPrimitiveRestart => "export it without primitive restart",
            _ => DAMAGED,
        }
    }

    /// Verdict at a place: faults in dispensable parts are never a reason to refuse.
    pub fn verdict_at(self, place: &str) -> Verdict {
        let spared = ["animations", "cameras", "images"].iter().any(|part| place.starts_with(part) && place != *part);
        match self.row().verdict {
            Verdict::Refuse if spared || is_bound(place) => Verdict::Warn,
            verdict => verdict,
        }
    }
}

/// Returns whether a place lies in a material, texture, sampler or light, or is a name: broken properties there can be left out.
pub(super) fn can_be_left_out(place: &str) -> bool {
    let looks = ["materials[", "textures[", "samplers["].iter().any(|list| place.starts_with(list));
    looks || place.contains("extensions.KHR_lights_punctual") || place.ends_with(".name")
}

/// Returns whether a place lies in the declared bounds of an accessor: `accessors[3].min[0]`.
fn is_bound(place: &str) -> bool {
    let property = place.strip_prefix("accessors[").and_then(|rest| rest.split_once("]."));
    property.is_some_and(|(_, rest)| matches!(rest.split('[').next(), Some("min" | "max")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_is_listed_once_with_a_reason() {
        for (i, row) in TABLE.iter().enumerate() {
            assert!(!row.why.is_empty(), "{}", row.khronos);
            assert!(TABLE[..i].iter().all(|other| other.khronos != row.khronos), "{} twice", row.khronos);
        }
        assert_eq!(Code::UnresolvedReference.name(), "gltf-unresolved-reference");
    }

    #[test]
    fn whatever_refuses_a_file_says_what_helps() {
        assert!(Code::GlbUnexpectedEndOfHeader.remedy().starts_with("it was cut off"));
        assert!(Code::UnknownAssetMajorVersion.remedy().starts_with("convert it"));
        assert!(Code::UnresolvedReference.remedy().starts_with("it is damaged"));
    }

    #[test]
    fn what_is_refused_or_warned_about_is_looked_for() {
        /// Codes covered by modules that use names of their own, or as a case of another code.
        const ELSEWHERE: &[(Code, &str)] = &[
            (Code::GlbInvalidMagic, "`detect` says what the file is instead"),
            (Code::IoError, "file-missing, file-unreadable and others, from `paths`"),
            (Code::NonRelativeUri, "uri-scheme, from `paths`"),
            (Code::ImageUnexpectedEos, "image-unusable or image-cut-off, from `texture`"),
            (Code::ArrayTypeMismatch, "a type mismatch of an element"),
        ];
        let sources = [
            include_str!("animation/play.rs"),
            include_str!("attributes.rs"),
            include_str!("bounds.rs"),
            include_str!("buffers.rs"),
            include_str!("container.rs"),
            include_str!("document.rs"),
            include_str!("extensions.rs"),
            include_str!("graph.rs"),
            include_str!("images.rs"),
            include_str!("links.rs"),
            include_str!("mesh.rs"),
            include_str!("mod.rs"),
            include_str!("cameras_lights.rs"),
            include_str!("schema.rs"),
            include_str!("skin.rs"),
            include_str!("sparse.rs"),
            include_str!("usage.rs"),
            include_str!("variants.rs"),
            include_str!("version.rs"),
        ];
        let text: String =
            sources.iter().map(|source| source.split("#[cfg(test)]\nmod tests {").next().unwrap()).collect();
        let told: Vec<&str> = text.split("Code::").skip(1).collect();
        let rows = NAMES_OF_CODES.iter().zip(TABLE).filter(|(_, row)| row.verdict != Verdict::Accept);
        let wrong = rows.filter(|(name, row)| {
            let ends = |rest: &str| !rest.starts_with(|c: char| c.is_alphanumeric());
            let used = told.iter().any(|rest| rest.strip_prefix(**name).is_some_and(ends));
            used == ELSEWHERE.iter().any(|(code, _why)| code.row().khronos == row.khronos)
        });
        let wrong: Vec<&str> = wrong.map(|(name, _)| *name).collect();
        assert!(wrong.is_empty(), "rules in name only, or told after all: {wrong:?}");
    }

    #[test]
    fn broken_animations_images_cameras_and_bounds_do_not_stop_a_still() {
        assert_eq!(Code::UndefinedProperty.verdict_at("cameras[0].perspective"), Verdict::Warn);
        assert_eq!(Code::TypeMismatch.verdict_at("cameras"), Verdict::Refuse);
        assert_eq!(Code::TypeMismatch.verdict_at("accessors[12].max[2]"), Verdict::Warn);
        assert_eq!(Code::TypeMismatch.verdict_at("accessors[12].min"), Verdict::Warn);
        assert_eq!(Code::TypeMismatch.verdict_at("accessors[12].count"), Verdict::Refuse);
        assert_eq!(Code::UnresolvedReference.verdict_at("animations[0].channels[1].sampler"), Verdict::Warn);
        assert_eq!(Code::TypeMismatch.verdict_at("images[3]"), Verdict::Warn);
        assert_eq!(Code::TypeMismatch.verdict_at("images"), Verdict::Refuse);
        assert_eq!(Code::UnresolvedReference.verdict_at("meshes[0].primitives[0].indices"), Verdict::Refuse);
    }
}
