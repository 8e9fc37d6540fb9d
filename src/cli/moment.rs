//! Requested moment of an animation.

use super::args::MomentArgs;
use super::job::UsageError;
use crate::load::Moment;

/// Default frame rate, in frames per second.
const FPS: f64 = 24.0;

/// Requested moment; `None`: the rest pose.
pub(super) fn moment(args: &MomentArgs) -> Result<Option<Moment>, UsageError> {
    if args.fps.is_some() && args.frame.is_none() {
        return Err(UsageError("--fps says how long a frame is; add --frame N".into()));
    }
    let time = args.time.or_else(|| Some(f64::from(args.frame?) / fps(args)));
    let any = time.is_some() || args.animation.is_some();
    Ok(any.then(|| Moment { animation: args.animation.clone(), time: time.unwrap_or(0.0) }))
}

/// Frame rate, in frames per second.
pub(super) fn fps(args: &MomentArgs) -> f64 {
    args.fps.unwrap_or(FPS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_a_time_and_an_animation_alone_is_its_start() {
        let none = MomentArgs { animation: None, time: None, frame: None, fps: None };
        assert_eq!(moment(&none), Ok(None));
        let named = MomentArgs { animation: Some("Run".into()), ..none.clone() };
        assert_eq!(moment(&named), Ok(Some(Moment { animation: Some("Run".into()), time: 0.0 })));
        let frame = MomentArgs { frame: Some(12), ..none.clone() };
        assert_eq!(moment(&frame).unwrap().unwrap().time, 0.5);
        let frame = MomentArgs { fps: Some(60.0), ..frame };
        assert_eq!(moment(&frame).unwrap().unwrap().time, 0.2);
        assert!(moment(&MomentArgs { fps: Some(60.0), ..none }).is_err());
    }
}
