//! Records: complete or absent, within the bound, and never a cause of failure.

use std::fs;
use std::path::PathBuf;
use std::time::Duration;

use super::*;
use crate::timeouts::{set_age, set_just_changed};

fn name(number: usize) -> Name {
    Name::of(&["test", &number.to_string()])
}

fn bytes(number: usize) -> Vec<u8> {
    (0..5000)
        .map(|index| (index * 7 + number * 13) as u8)
        .collect()
}

fn cache(max_bytes: u64) -> (tempfile::TempDir, DiskCache) {
    let folder = tempfile::tempdir().expect("a folder");
    let cache = DiskCache::at(folder.path(), max_bytes);
    (folder, cache)
}

/// Returns the path of a record.
fn path(folder: &tempfile::TempDir, number: usize) -> PathBuf {
    folder.path().join(VERSION).join(name(number).path())
}

/// Returns the size of all files, bytes.
fn used(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let each = entries.map(|entry| match entry.path().is_dir() {
        true => used(&entry.path()),
        false => entry.metadata().map_or(0, |metadata| metadata.len()),
    });
    each.sum()
}

#[test]
fn record_is_found_by_its_name() {
    let (folder, cache) = cache(1 << 20);
    assert_eq!(cache.get(&name(1)), None);
    cache.put(&name(1), &bytes(1));
    cache.put(&name(2), &[]);
    let other = DiskCache::at(folder.path(), 1 << 20);
    assert_eq!(other.get(&name(1)), Some(bytes(1)));
    assert_eq!(other.get(&name(2)), Some(vec![]));
    assert_eq!(other.get(&name(3)), None);
    other.put(&name(1), &bytes(9));
    assert_eq!(cache.get(&name(1)), Some(bytes(9)));
    // Texts that are equal when joined have different names.
    assert_ne!(Name::of(&["ab", "c"]), Name::of(&["a", "bc"]));
}

#[test]
fn damaged_or_foreign_record_counts_as_absent() {
    let (folder, cache) = cache(1 << 20);
    cache.put(&name(1), &bytes(1));
    cache.put(&name(2), &bytes(2));
    let (whole, other) = (path(&folder, 1), path(&folder, 2));
    let record = fs::read(&whole).expect("there");
    for length in [0, 1, 8, 39, 40, 41, record.len() - 1] {
        fs::write(&whole, &record[..length]).expect("written");
        assert_eq!(cache.get(&name(1)), None, "{length}");
    }
    for place in (0..record.len()).step_by(37).chain(0..48) {
        let mut damaged = record.clone();
        damaged[place] ^= 0x10;
        fs::write(&whole, damaged).expect("written");
        assert_eq!(cache.get(&name(1)), None, "{place}");
    }
    fs::copy(&other, &whole).expect("copied");
    assert_eq!(cache.get(&name(1)), None, "it is of another name");
    fs::write(&whole, vec![0; 2 << 20]).expect("written");
    assert_eq!(cache.get(&name(1)), None, "it is too large");
    fs::remove_file(&whole).expect("removed");
    fs::create_dir(&whole).expect("made");
    assert_eq!(cache.get(&name(1)), None, "it is a folder");
    cache.put(&name(1), &bytes(1));
    assert_eq!(cache.get(&name(1)), None);
    fs::write(&other, &record).expect("written");
    assert_eq!(cache.get(&name(2)), None);
}

#[test]
fn only_least_recently_used_records_are_evicted() {
    const MAX: u64 = 400 << 10;
    let (folder, cache) = cache(MAX);
    let foreign = folder.path().join(VERSION).join("ab").join("mine.txt");
    fs::create_dir_all(foreign.parent().expect("it has one")).expect("made");
    fs::write(&foreign, [1; 100]).expect("written");
    let beside = folder.path().join("other");
    fs::write(&beside, [1; 100]).expect("written");
    for number in 0..300 {
        cache.put(&name(number), &bytes(number));
        // Each is some hours older than the next.
        let age = Duration::from_secs(3600 * (1000 - number as u64));
        set_age(&path(&folder, number), age);
        // This record is used again and again.
        assert_eq!(cache.get(&name(0)), Some(bytes(0)), "{number}");
        assert!(used(folder.path()) <= MAX + 200, "{}", used(folder.path()));
    }
    assert!(cache.get(&name(299)).is_some() && cache.get(&name(280)).is_some());
    assert!((1..200).all(|number| cache.get(&name(number)).is_none()));
    assert!(foreign.exists() && beside.exists());
}

#[test]
fn size_limit_includes_records_of_other_programs() {
    const MAX: u64 = 1 << 20;
    let (folder, one) = cache(MAX);
    let other = DiskCache::at(folder.path(), MAX);
    for number in 0..600 {
        let cache = if number % 2 == 0 { &one } else { &other };
        cache.put(&name(number), &bytes(number));
        assert!(used(folder.path()) <= MAX + MAX / 4, "{number}");
    }
}

#[test]
fn concurrent_caches_read_only_whole_records() {
    let (folder, _) = cache(0);
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                // Caches as in separate programs.
                let cache = DiskCache::at(folder.path(), 100 << 10);
                for round in 0..300 {
                    let number = round % 40;
                    cache.put(&name(number), &bytes(number));
                    if let Some(found) = cache.get(&name((round + 20) % 40)) {
                        assert_eq!(found, bytes((round + 20) % 40));
                    }
                    if round % 100 == 99 {
                        // Another program deletes the folder in between.
                        let _ = fs::remove_dir_all(folder.path().join(VERSION));
                    }
                }
            });
        }
    });
}

#[test]
fn disabled_or_unusable_folder_stores_nothing_without_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    fs::write(&file, b"mine").expect("written");
    for cache in [
        DiskCache::off(),
        DiskCache::at(&folder.path().join("off"), 0),
        DiskCache::at(&file, 1 << 20),
    ] {
        cache.put(&name(1), &bytes(1));
        assert_eq!(cache.get(&name(1)), None);
    }
    assert_eq!(fs::read(&file).expect("there"), b"mine");
    assert!(!folder.path().join("off").exists());
    // Larger than the largest record.
    let cache = DiskCache::at(folder.path(), 1 << 30);
    cache.put(&name(1), &vec![0; MAX_RECORD + 1]);
    assert_eq!(cache.get(&name(1)), None);
}

#[cfg(unix)]
#[test]
fn folder_writable_by_others_is_not_used() {
    use std::os::unix::fs::PermissionsExt;
    let (folder, cache) = cache(1 << 20);
    cache.put(&name(1), &bytes(1));
    let own = folder.path().join(VERSION);
    for open in [folder.path(), &own] {
        for (mode, is_used) in [(0o757, false), (0o770, false), (0o755, true)] {
            fs::set_permissions(open, fs::Permissions::from_mode(mode)).expect("set");
            // A separate program: after a failed write, a cache does not retry.
            let cache = DiskCache::at(folder.path(), 1 << 20);
            assert_eq!(cache.get(&name(1)).is_some(), is_used, "{mode:o}");
            cache.put(&name(2), &bytes(2));
            assert_eq!(path(&folder, 2).exists(), is_used, "{mode:o}");
            assert_eq!(cache.create_unnamed(1).is_ok(), is_used, "{mode:o}");
            let _ = fs::remove_file(path(&folder, 2));
        }
    }
    // Only root can change a folder's owner.
    if std::os::unix::fs::chown(&own, Some(65_534), None).is_ok() {
        assert_eq!(cache.get(&name(1)), None, "it is another user's");
    }
}

#[cfg(unix)]
#[test]
fn linked_folder_is_refused_and_its_files_are_kept() {
    use std::os::unix::fs::symlink;
    let target = tempfile::tempdir().expect("a folder");
    let foreign = target.path().join(name(1).path());
    fs::create_dir_all(foreign.parent().expect("it has one")).expect("made");
    fs::write(&foreign, vec![1; 1 << 19]).expect("written");
    let (folder, linked) = (tempfile::tempdir().expect("a folder"), target.path());
    symlink(linked, folder.path().join(VERSION)).expect("linked");
    symlink(linked, folder.path().join("link")).expect("linked");
    for named in [folder.path().to_owned(), folder.path().join("link")] {
        let cache = DiskCache::at(&named, 64 << 10);
        cache.put(&name(2), &bytes(2));
        assert_eq!(cache.get(&name(2)), None);
        let why = cache.create_unnamed(1).err().expect("refused");
        assert!(why.to_string().contains("is a link"), "{why}");
        assert!(foreign.exists(), "{}", named.display());
        assert_eq!(fs::read_dir(linked).expect("listed").count(), 1);
    }
}

#[test]
fn leftover_file_of_a_killed_program_is_deleted() {
    let (folder, cache) = cache(64 << 10);
    let inner = folder.path().join(VERSION).join("00");
    fs::create_dir_all(&inner).expect("made");
    let left = inner.join(".new-killed");
    fs::write(&left, [0; 50]).expect("written");
    set_age(&left, Duration::from_secs(7200));
    cache.put(&name(1), &bytes(1));
    assert!(!left.exists());
}

#[test]
fn file_stamp_differs_between_files_and_after_a_change() {
    let folder = tempfile::tempdir().expect("a folder");
    let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
    fs::write(&a, [1; 9]).expect("written");
    set_just_changed(&a);
    let first = FileStamp::at(&a).expect("there");
    assert_eq!(first.stable_text(), None, "it was written a moment ago");
    set_age(&a, Duration::from_secs(100));
    let aged = FileStamp::at(&a).expect("there");
    assert!(aged.stable_text().is_some() && aged != first);
    assert_eq!(FileStamp::at(&a).as_ref(), Some(&aged));
    fs::copy(&a, &b).expect("copied");
    assert_ne!(FileStamp::at(&b).as_ref(), Some(&aged));
    // Other bytes, with the same size and time.
    let modified = fs::metadata(&a).and_then(|metadata| metadata.modified());
    fs::write(&a, [2; 9]).expect("written");
    let file = fs::File::options().append(true).open(&a).expect("opens");
    file.set_modified(modified.expect("known")).expect("set");
    if cfg!(unix) {
        assert_ne!(FileStamp::at(&a).as_ref(), Some(&aged));
    }
    fs::rename(&b, &a).expect("renamed");
    assert_ne!(FileStamp::at(&a).as_ref(), Some(&aged));
    assert_eq!(FileStamp::at(&b), None);
}
