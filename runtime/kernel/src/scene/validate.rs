//! The wall between an IR from outside and indices that are used unseen.
use super::SceneError;
use super::arrays::SceneArrays;
use crate::bvh::MAX_ITEMS;

/// Leaf numbers are kept in f64 lanes while tracing: exact below this.
const MAX_LEAVES: i64 = 1 << 53;

/// What the checks found out on their way.
pub(super) struct Checked {
    /// Groups in an order in which each comes after all that it contains.
    pub order: Vec<usize>,
    /// Leaves of each group, fully expanded.
    pub leaf_counts: Vec<i64>,
}

fn fail<T>(message: String) -> Result<T, SceneError> {
    Err(SceneError(message))
}

/// A range of an array of `len`, given as IR integers.
pub(super) fn range(
    what: &str,
    [start, end]: [i64; 2],
    len: usize,
) -> Result<std::ops::Range<usize>, SceneError> {
    if start < 0 || end < start || end as u64 > len as u64 {
        return fail(format!("{what}: {start}..{end} is not within 0..{len}"));
    }
    Ok(start as usize..end as usize)
}

/// Checks every index and length; shapes and meshes are checked where they are prepared.
pub(super) fn validate(arrays: &SceneArrays) -> Result<Checked, SceneError> {
    let n = arrays.instance_target.len();
    for (name, len) in [
        ("world_from_object", arrays.world_from_object.len()),
        ("object_from_world", arrays.object_from_world.len()),
        ("instance_material", arrays.instance_material.len()),
    ] {
        if len != n {
            return fail(format!("{name} has {len} rows for {n} instances"));
        }
    }
    let low = arrays.translation_low.len();
    if low != 0 && low != n {
        return fail(format!("translation_low has {low} rows for {n} instances"));
    }
    let prototypes = arrays.prototype_kind.len();
    if arrays.prototype_data.len() != prototypes {
        return fail(format!(
            "prototype_data has {} rows for {prototypes} prototypes",
            arrays.prototype_data.len()
        ));
    }
    let groups = arrays.group_ranges.len();
    if groups == 0 {
        return fail("group_ranges is empty: group 0 is the root".into());
    }
    for (i, &target) in arrays.instance_target.iter().enumerate() {
        let known = if target >= 0 { prototypes } else { groups };
        let index = if target >= 0 { target } else { !target };
        if index as usize >= known {
            return fail(format!("instance {i} has the unknown target {target}"));
        }
    }
    for (i, &material) in arrays.instance_material.iter().enumerate() {
        let index = if material < -1 {
            -2 - i64::from(material)
        } else {
            i64::from(material.max(0))
        };
        if index >= arrays.material_count as i64 {
            return fail(format!("instance {i} has the unknown material {material}"));
        }
    }
    let mut grouped = 0;
    for (group, &ends) in arrays.group_ranges.iter().enumerate() {
        let range = range(&format!("group {group}"), ends, n)?;
        grouped += range.len();
        if range.len() > MAX_ITEMS {
            return fail(format!(
                "group {group} has {} instances; the limit is {MAX_ITEMS}",
                range.len()
            ));
        }
    }
    if grouped > n {
        return fail(format!(
            "groups overlap: they hold {grouped} of {n} instances"
        ));
    }
    expand(arrays)
}

/// Orders the groups, refusing cycles, and counts their leaves.
fn expand(arrays: &SceneArrays) -> Result<Checked, SceneError> {
    let groups = arrays.group_ranges.len();
    let range = |group: usize| {
        let [start, end] = arrays.group_ranges[group];
        start as usize..end as usize
    };
    let mut leaf_counts = vec![0i64; groups];
    let mut order = Vec::with_capacity(groups);
    let mut entered = vec![false; groups];
    let mut finished = vec![false; groups];
    let mut path = Vec::new();
    for first in 0..groups {
        if entered[first] {
            continue;
        }
        entered[first] = true;
        path.push((first, range(first)));
        while let Some((group, rest)) = path.last_mut() {
            let group = *group;
            if let Some(instance) = rest.next() {
                let target = arrays.instance_target[instance];
                if target >= 0 {
                    continue;
                }
                let inner = !target as usize;
                if !entered[inner] {
                    entered[inner] = true;
                    path.push((inner, range(inner)));
                } else if !finished[inner] {
                    return fail(format!("group {inner} contains itself"));
                }
                continue;
            }
            let leaves = range(group).try_fold(0i64, |sum, instance| {
                let target = arrays.instance_target[instance];
                let inner = if target >= 0 {
                    1
                } else {
                    leaf_counts[!target as usize]
                };
                Some(sum + inner).filter(|&sum| sum <= MAX_LEAVES)
            });
            let Some(leaves) = leaves else {
                return fail(format!("group {group} has more than {MAX_LEAVES} leaves"));
            };
            leaf_counts[group] = leaves;
            finished[group] = true;
            order.push(group);
            path.pop();
        }
    }
    Ok(Checked { order, leaf_counts })
}
