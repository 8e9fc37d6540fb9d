//! Published figures of the SPD scenes: numbers of objects and rays, and costs of a grid and an octree.

/// Published figures of one scene.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    /// File name, without `.nff`.
    pub name: &'static str,
    /// Number of polygons, patches, spheres, cones and cylinders.
    pub objects: u32,
    /// Numbers of rays by Havran and Sixta.
    pub rays: Rays,
    /// Haines' numbers of rays, "within about 10 %" of any program's; none for `lattice`.
    pub haines: Option<HainesRays>,
    /// Uniform grids by three rules of resolution.
    pub grids: [Grid; 3],
    /// Octrees of depths 4 to 7.
    pub octrees: [Octree; 4],
    /// Margin of the boxes of faces along their normals that reproduces the published numbers of cells; 0 without any. It is not
    /// published but was found by trial.
    pub thickness: f64,
}

/// Numbers of rays sent, and of those that hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rays {
    /// Primary rays.
    pub primary: u64,
    /// Primary rays that hit.
    pub primary_hits: u64,
    /// Shadow rays.
    pub shadow: u64,
    /// Shadow rays that hit something before the light.
    pub shadow_hits: u64,
    /// Reflected and refracted rays.
    pub secondary: u64,
    /// Reflected and refracted rays that hit.
    pub secondary_hits: u64,
}

/// Numbers of rays in Haines' table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HainesRays {
    /// Primary rays that hit.
    pub primary_hits: u64,
    /// Reflected rays.
    pub reflected: u64,
    /// Refracted rays.
    pub refracted: u64,
    /// Shadow rays.
    pub shadow: u64,
}

/// Composition of a structure, and its costs per ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// Interior nodes; 0 in a grid.
    pub n_in: u64,
    /// Cells.
    pub n_v: u64,
    /// Empty cells.
    pub n_ev: u64,
    /// References: objects listed in all cells.
    pub n_oiv: u64,
    /// Ray/object tests per ray.
    pub n_it: f64,
    /// Steps per ray. Programs disagree on what a step in an octree is.
    pub n_ts: f64,
    /// Cells visited per ray.
    pub n_ets: f64,
    /// Empty cells visited per ray.
    pub n_eets: f64,
}

/// Published uniform grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Rule by which the resolution was chosen.
    pub setting: &'static str,
    /// Cells per axis.
    pub cells: [u32; 3],
    /// Published costs.
    pub cost: Figures,
}

/// Havran's *Octree84-C*: A. Glassner's octree of 1984, with cells split in the middle, at most one object per leaf above the
/// maximum depth, and objects assigned to cells by their boxes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Octree {
    /// Maximum depth; the root has depth 0.
    pub depth: u32,
    /// Published costs.
    pub cost: Figures,
}

/// Figures in the order of a printed row.
const fn cost([n_in, n_v, n_ev, n_oiv]: [u64; 4], [n_it, n_ts, n_ets, n_eets]: [f64; 4]) -> Figures {
    Figures { n_in, n_v, n_ev, n_oiv, n_it, n_ts, n_ets, n_eets }
}

/// All eight scenes.
pub const SCENES: [Scene; 8] = [
    Scene {
        name: "balls",
        objects: 7382,
        rays: Rays {
            primary: 263_169,
            primary_hits: 263_169,
            shadow: 959_244,
            shadow_hits: 285_178,
            secondary: 179_884,
            secondary_hits: 134_368,
        },
        haines: Some(HainesRays { primary_hits: 263_169, reflected: 175_095, refracted: 0, shadow: 954_368 }),
        grids: [
            Grid {
                setting: "D = 1",
                cells: [46, 46, 3],
                cost: cost([0, 6348, 4208, 10_240], [358.66, 5.69, 5.69, 3.0]),
            },
            Grid {
                setting: "D = 10",
                cells: [103, 103, 7],
                cost: cost([0, 74_263, 63_393, 19_966], [72.54, 12.4, 12.4, 9.27]),
            },
            Grid {
                setting: "customary",
                cells: [152, 152, 9],
                cost: cost([0, 207_936, 184_204, 33_909], [41.48, 17.32, 17.32, 13.93]),
            },
        ],
        octrees: [
            Octree { depth: 4, cost: cost([57, 400, 300, 9171], [1787.0, 48.53, 9.93, 3.67]) },
            Octree { depth: 5, cost: cost([117, 820, 570, 10_946], [577.7, 86.96, 15.39, 9.52]) },
            Octree { depth: 6, cost: cost([304, 2129, 1038, 15_611], [209.6, 123.2, 19.88, 12.54]) },
            Octree { depth: 7, cost: cost([1108, 7757, 2905, 27_288], [94.75, 167.0, 24.71, 16.12]) },
        ],
        thickness: 0.0,
    },
    Scene {
        name: "gears",
        objects: 9345,
        rays: Rays {
            primary: 263_169,
            primary_hits: 245_332,
            shadow: 2_088_012,
            shadow_hits: 1_057_557,
            secondary: 494_338,
            secondary_hits: 365_338,
        },
        haines: Some(HainesRays { primary_hits: 245_086, reflected: 304_643, refracted: 207_564, shadow: 2_246_955 }),
        grids: [
            Grid {
                setting: "D = 1",
                cells: [32, 33, 9],
                cost: cost([0, 9504, 6080, 39_344], [39.76, 6.84, 6.84, 3.62]),
            },
            Grid {
                setting: "D = 10",
                cells: [71, 71, 18],
                cost: cost([0, 90_738, 66_531, 110_029], [22.82, 13.83, 13.83, 9.19]),
            },
            Grid {
                setting: "customary",
                cells: [98, 98, 25],
                cost: cost([0, 240_100, 194_920, 171_316], [17.52, 18.95, 18.95, 14.62]),
            },
        ],
        octrees: [
            Octree { depth: 4, cost: cost([265, 1856, 652, 39_440], [157.5, 27.46, 5.71, 2.07]) },
            Octree { depth: 5, cost: cost([1405, 9836, 4088, 85_832], [71.38, 46.49, 8.33, 4.64]) },
            Octree { depth: 6, cost: cost([5837, 40_860, 10_334, 235_526], [44.22, 65.25, 10.64, 5.66]) },
            Octree { depth: 7, cost: cost([28_447, 199_130, 28_228, 879_434], [39.13, 88.6, 13.2, 6.27]) },
        ],
        thickness: 0.0222,
    },
    Scene {
        name: "lattice",
        objects: 8281,
        rays: Rays {
            primary: 263_169,
            primary_hits: 261_170,
            shadow: 1_180_774,
            shadow_hits: 943_159,
            secondary: 243_210,
            secondary_hits: 178_786,
        },
        haines: None,
        grids: [
            Grid { setting: "D = 1", cells: [20, 20, 20], cost: cost([0, 8000, 0, 32_152], [20.67, 5.09, 5.09, 0.0]) },
            Grid {
                setting: "D = 10",
                cells: [44, 44, 44],
                cost: cost([0, 85_184, 38_016, 90_368], [9.26, 10.56, 10.56, 5.09]),
            },
            Grid {
                setting: "customary",
                cells: [59, 59, 59],
                cost: cost([0, 205_379, 102_640, 160_819], [8.81, 13.7, 13.7, 7.51]),
            },
        ],
        octrees: [
            Octree { depth: 4, cost: cost([585, 4096, 0, 22_112], [28.6, 22.03, 4.41, 0.0]) },
            Octree { depth: 5, cost: cost([4681, 32_768, 7744, 49_600], [13.8, 47.88, 7.98, 1.71]) },
            Octree { depth: 6, cost: cost([17_993, 125_952, 28_732, 147_494], [11.07, 67.59, 10.35, 2.91]) },
            Octree { depth: 7, cost: cost([56_235, 393_646, 52_822, 502_272], [10.82, 77.21, 11.36, 3.17]) },
        ],
        thickness: 0.0,
    },
    Scene {
        name: "mount",
        objects: 8196,
        rays: Rays {
            primary: 263_169,
            primary_hits: 173_685,
            shadow: 361_037,
            shadow_hits: 74_555,
            secondary: 710_436,
            secondary_hits: 472_351,
        },
        haines: Some(HainesRays { primary_hits: 173_125, reflected: 354_769, refracted: 354_769, shadow: 412_922 }),
        grids: [
            Grid {
                setting: "D = 1",
                cells: [20, 20, 20],
                cost: cost([0, 8000, 6502, 21_746], [19.01, 8.85, 8.85, 4.97]),
            },
            Grid {
                setting: "D = 10",
                cells: [44, 44, 42],
                cost: cost([0, 81_312, 71_924, 51_144], [13.17, 18.43, 18.43, 11.93]),
            },
            Grid {
                setting: "customary",
                cells: [35, 35, 35],
                cost: cost([0, 42_875, 37_246, 38_922], [13.32, 15.01, 15.01, 9.6]),
            },
        ],
        octrees: [
            Octree { depth: 4, cost: cost([232, 1625, 777, 18_107], [42.53, 22.43, 4.92, 1.82]) },
            Octree { depth: 5, cost: cost([1019, 7134, 3060, 34_351], [23.72, 30.89, 6.08, 2.33]) },
            Octree { depth: 6, cost: cost([4716, 33_013, 11_720, 90_456], [18.3, 43.68, 7.64, 2.83]) },
            Octree { depth: 7, cost: cost([22_630, 158_411, 45_049, 324_918], [18.52, 60.08, 9.44, 3.31]) },
        ],
        thickness: 0.0008,
    },
    Scene {
        name: "rings",
        objects: 8401,
        rays: Rays {
            primary: 263_169,
            primary_hits: 263_169,
            shadow: 1_077_336,
            shadow_hits: 510_719,
            secondary: 312_879,
            secondary_hits: 175_688,
        },
        haines: Some(HainesRays { primary_hits: 263_169, reflected: 315_236, refracted: 0, shadow: 1_085_002 }),
        grids: [
            Grid {
                setting: "D = 1",
                cells: [21, 20, 21],
                cost: cost([0, 8820, 6264, 27_666], [45.29, 11.78, 11.78, 7.33]),
            },
            Grid {
                setting: "D = 10",
                cells: [44, 43, 44],
                cost: cost([0, 83_248, 66_753, 71_303], [23.36, 24.51, 24.51, 18.84]),
            },
            Grid {
                setting: "customary",
                cells: [60, 60, 60],
                cost: cost([0, 216_000, 178_930, 127_217], [21.48, 33.71, 33.71, 27.22]),
            },
        ],
        octrees: [
            Octree { depth: 4, cost: cost([231, 1618, 416, 22_505], [107.8, 32.34, 6.93, 2.91]) },
            Octree { depth: 5, cost: cost([1216, 8513, 2127, 44_555], [47.9, 53.74, 9.92, 4.98]) },
            Octree { depth: 6, cost: cost([6925, 48_476, 10_281, 133_929], [35.12, 81.9, 13.38, 6.69]) },
            Octree { depth: 7, cost: cost([38_648, 270_537, 49_888, 565_631], [35.2, 120.8, 17.65, 8.29]) },
        ],
        thickness: 0.0,
    },
    Scene {
        name: "teapot",
        objects: 9264,
        rays: Rays {
            primary: 263_169,
            primary_hits: 161_546,
            shadow: 406_340,
            shadow_hits: 34_757,
            secondary: 226_235,
            secondary_hits: 67_688,
        },
        haines: Some(HainesRays { primary_hits: 161_120, reflected: 225_248, refracted: 0, shadow: 407_656 }),
        grids: [
            Grid {
                setting: "D = 1",
                cells: [28, 29, 11],
                cost: cost([0, 8932, 7226, 22_982], [33.65, 14.98, 14.98, 12.25]),
            },
            Grid {
                setting: "D = 10",
                cells: [61, 61, 25],
                cost: cost([0, 93_025, 83_721, 52_781], [15.13, 32.5, 32.5, 29.6]),
            },
            Grid {
                setting: "customary",
                cells: [80, 80, 30],
                cost: cost([0, 192_000, 175_514, 75_105], [13.3, 41.24, 41.24, 38.08]),
            },
        ],
        octrees: [
            Octree { depth: 4, cost: cost([227, 1590, 777, 18_845], [184.0, 33.66, 7.61, 5.14]) },
            Octree { depth: 5, cost: cost([1001, 7008, 3450, 34_072], [78.3, 48.74, 9.73, 7.07]) },
            Octree { depth: 6, cost: cost([4100, 28_701, 12_327, 83_551], [45.63, 64.67, 11.69, 8.61]) },
            Octree { depth: 7, cost: cost([18_066, 126_463, 38_316, 295_865], [40.02, 83.4, 13.75, 9.53]) },
        ],
        thickness: 0.0,
    },
    Scene {
        name: "tetra",
        objects: 4096,
        rays: Rays {
            primary: 263_169,
            primary_hits: 49_950,
            shadow: 46_262,
            shadow_hits: 5538,
            secondary: 0,
            secondary_hits: 0,
        },
        haines: Some(HainesRays { primary_hits: 49_788, reflected: 0, refracted: 0, shadow: 46_112 }),
        grids: [
            Grid {
                setting: "D = 1",
                cells: [16, 16, 16],
                cost: cost([0, 4096, 3104, 12_556], [20.64, 7.43, 7.43, 5.83]),
            },
            Grid {
                setting: "D = 10",
                cells: [35, 35, 35],
                cost: cost([0, 42_875, 37_311, 35_936], [10.01, 15.97, 15.97, 14.36]),
            },
            Grid {
                setting: "customary",
                cells: [40, 40, 40],
                cost: cost([0, 64_000, 56_696, 44_696], [9.17, 18.24, 18.24, 16.63]),
            },
        ],
        octrees: [
            Octree { depth: 4, cost: cost([305, 2136, 1072, 13_312], [120.0, 21.54, 4.72, 3.05]) },
            Octree { depth: 5, cost: cost([1369, 9584, 4764, 32_768], [63.58, 32.08, 6.2, 4.48]) },
            Octree { depth: 6, cost: cost([6189, 43_324, 21_100, 110_592], [46.77, 44.09, 7.67, 5.93]) },
            Octree { depth: 7, cost: cost([28_413, 198_892, 80_444, 512_000], [47.07, 58.09, 9.21, 7.22]) },
        ],
        thickness: 0.0,
    },
    Scene {
        name: "tree",
        objects: 8191,
        rays: Rays {
            primary: 263_169,
            primary_hits: 169_907,
            shadow: 1_110_323,
            shadow_hits: 47_506,
            secondary: 0,
            secondary_hits: 0,
        },
        haines: Some(HainesRays { primary_hits: 169_836, reflected: 0, refracted: 0, shadow: 1_097_419 }),
        grids: [
            Grid { setting: "D = 1", cells: [52, 52, 3], cost: cost([0, 8112, 5400, 11_102], [727.62, 7.6, 7.6, 4.5]) },
            Grid {
                setting: "D = 10",
                cells: [117, 118, 5],
                cost: cost([0, 69_030, 55_191, 22_407], [246.08, 15.45, 15.45, 11.67]),
            },
            Grid {
                setting: "customary",
                cells: [60, 60, 60],
                cost: cost([0, 216_000, 212_179, 14_322], [355.45, 56.36, 56.36, 45.36]),
            },
        ],
        octrees: [
            Octree { depth: 4, cost: cost([53, 372, 278, 9029], [8066.0, 63.48, 13.1, 3.67]) },
            Octree { depth: 5, cost: cost([101, 708, 556, 9670], [4201.0, 113.6, 20.24, 9.91]) },
            Octree { depth: 6, cost: cost([186, 1303, 1054, 10_915], [2098.0, 169.0, 27.16, 17.67]) },
            Octree { depth: 7, cost: cost([352, 2465, 1801, 13_725], [741.3, 219.3, 32.74, 23.33]) },
        ],
        thickness: 0.0,
    },
];
