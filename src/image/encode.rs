//! Encoding into every format.

use super::{FileKind, ImageError, Metadata, Output, Picture, exr, photo, png};

/// Encodes a picture as the bytes of a file. The same picture, choices and metadata give the same bytes.
pub fn encode(picture: &Picture, kind: FileKind, output: &Output, metadata: &Metadata) -> Result<Vec<u8>, ImageError> {
    check_shape(picture)?;
    match kind {
        FileKind::Png => png::encode(picture, output, metadata),
        FileKind::Exr => exr::encode(picture, output, metadata),
        FileKind::Jpeg => photo::encode_jpeg(picture, output, metadata),
        FileKind::Webp => photo::encode_webp(picture, output, metadata),
    }
}

/// Refuses pictures without pixels, which no format holds, and arrays whose length is not one value per pixel.
fn check_shape(picture: &Picture) -> Result<(), ImageError> {
    let (width, height) = (picture.width, picture.height);
    let pixels = width as usize * height as usize;
    let fault = |array, len| ImageError::Shape { width, height, array, len };
    if pixels == 0 || picture.beauty.len() != pixels {
        return Err(fault("beauty", picture.beauty.len()));
    }
    if !picture.veil.is_empty() && picture.veil.len() != pixels {
        return Err(fault("veil", picture.veil.len()));
    }
    let Some(layers) = &picture.layers else { return Ok(()) };
    let own = [
        ("albedo", layers.albedo.len()),
        ("normal", layers.normal.len()),
        ("position", layers.position.len()),
        ("depth", layers.depth.len()),
        ("prim", layers.prim.len()),
        ("instance", layers.instance.len()),
    ];
    let channels = layers.channels.iter().map(|c| ("channels", c.values.len()));
    let wrong = own.into_iter().chain(channels).find(|&(_, len)| len != 0 && len != pixels);
    wrong.map_or(Ok(()), |(array, len)| Err(fault(array, len)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Layers;

    #[test]
    fn a_picture_whose_arrays_do_not_fit_is_refused_in_every_format() {
        let layers = Layers { depth: vec![0.0; 3], ..Layers::default() };
        let faulty = [
            Picture::default(),
            Picture::of(2, 2, vec![[0.0; 4]; 3]),
            Picture { layers: Some(layers), ..Picture::of(2, 2, vec![[0.0; 4]; 4]) },
            Picture { veil: vec![[0.0; 4]; 2], ..Picture::of(2, 2, vec![[0.0; 4]; 4]) },
        ];
        for picture in &faulty {
            for kind in FileKind::ALL {
                let fault = encode(picture, kind, &Output::default(), &Metadata::default()).unwrap_err();
                assert!(matches!(fault, ImageError::Shape { .. }), "{kind}: {fault}");
            }
        }
    }

    #[test]
    fn one_pixel_is_a_picture_in_every_format() {
        let picture = Picture::of(1, 1, vec![[0.5; 4]]);
        for kind in FileKind::ALL {
            assert!(encode(&picture, kind, &Output::default(), &Metadata::new()).is_ok(), "{kind}");
        }
    }

    #[test]
    fn the_number_of_threads_does_not_show() {
        let beauty = (0..97 * 61).map(|i| [i as f32 * 1e-3, 0.3, 0.1, (i % 9) as f32 / 8.0]).collect();
        let picture = Picture::of(97, 61, beauty);
        for kind in FileKind::ALL {
            let bytes = [1, 2, 7].map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| encode(&picture, kind, &Output::default(), &Metadata::new()).unwrap())
            });
            assert!(bytes[0] == bytes[1] && bytes[1] == bytes[2], "{kind}");
        }
    }
}
