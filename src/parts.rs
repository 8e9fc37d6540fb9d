//! Lists that several threads build or fill, each its own part.

use bytemuck::Zeroable;
use rayon::prelude::*;

/// Cuts a list into consecutive parts of the given lengths, which add up to the length of the list.
pub(crate) fn cut<T>(mut all: &mut [T], lengths: impl Iterator<Item = usize>) -> Vec<&mut [T]> {
    lengths.map(|length| all.split_off_mut(..length).unwrap_or_default()).collect()
}

/// Concatenates lists; a single list is not copied.
pub(crate) fn joined<T: Copy + Zeroable + Send + Sync>(mut lists: Vec<Vec<T>>) -> Vec<T> {
    if lists.len() == 1 {
        return lists.pop().unwrap_or_default();
    }
    // The threads that fill the parts are the ones that touch the pages first.
    let mut all: Vec<T> = bytemuck::zeroed_vec(lists.iter().map(Vec::len).sum());
    let parts = cut(&mut all, lists.iter().map(Vec::len));
    parts.into_par_iter().zip(lists).for_each(|(part, list)| part.copy_from_slice(&list));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_joined_in_their_order_and_cut_apart_again() {
        let lists = vec![vec![1u32, 2], Vec::new(), vec![3], (4..5000).collect()];
        let lengths: Vec<usize> = lists.iter().map(Vec::len).collect();
        let mut all = joined(lists.clone());
        assert!(all.iter().copied().eq(1..5000));
        assert!(cut(&mut all, lengths.into_iter()).into_iter().eq(lists));
        assert_eq!((joined(Vec::<Vec<u32>>::new()), joined(vec![vec![7]])), (Vec::new(), vec![7]));
    }
}
