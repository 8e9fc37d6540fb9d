//! `meshray inspect`.
use super::Exit;
use super::args::InspectArgs;
/// x
pub(super) fn run(_args: &InspectArgs) -> Exit {
    Exit::Done
}
