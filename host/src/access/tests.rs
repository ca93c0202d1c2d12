use clap::Parser;

use super::*;
use crate::state::settings::Settings;

#[derive(Parser)]
struct Flags {
    #[command(flatten)]
    settings: Settings,
}

fn keys(flags: &[&str]) -> Result<Keys, String> {
    let flags = Flags::try_parse_from(["gramian"].iter().chain(flags)).unwrap();
    Keys::new(&flags.settings.api_keys, flags.settings.keys_file.as_deref())
}

fn owner_of(keys: &Keys, key: &str) -> Option<Owner> {
    keys.caller_of(key).map(|caller| caller.owner)
}

#[test]
fn each_key_has_its_owner_and_others_have_none() {
    let two = keys(&["--api-keys", "one, two "]).unwrap();
    assert_eq!((owner_of(&two, "one"), owner_of(&two, "two")), (Some(Owner(0)), Some(Owner(1))));
    assert!(owner_of(&two, "").is_none() && owner_of(&two, "three").is_none() && !two.is_open());
    let one = keys(&["--api-keys", "two"]).unwrap();
    assert_eq!(two.name_of(Owner(1)), one.name_of(Owner(0)));
    assert_ne!(two.name_of(Owner(1)), two.name_of(Owner(0)));
    let open = keys(&[]).unwrap();
    assert!(open.is_open() && open.owners() == [Owner(0)] && open.name_of(Owner(0)).0 == "everyone");
}

#[test]
fn keys_are_replaced_and_their_views_stay() {
    let (one, lines_of_one) = generate("one").unwrap();
    let (two, lines_of_two) = generate("two").unwrap();
    let (next, lines_of_next) = generate("one-2027").unwrap();
    let path = std::env::temp_dir().join(format!("gramian-keys-{}.toml", std::process::id()));
    std::fs::write(&path, format!("{lines_of_one}requests_per_minute = 1\n{lines_of_two}")).unwrap();
    let keys = keys(&["--keys-file", path.to_str().unwrap()]).unwrap();
    std::fs::remove_file(&path).unwrap();
    let before = keys.caller_of(&one).unwrap();
    assert!(before.enter().is_ok() && before.enter().is_err());
    let both =
        format!("{lines_of_two}{lines_of_next}view = \"one\"\n{lines_of_one}requests_per_minute = 1\n");
    keys.replace_keys(&KeysFile::parse(&both).unwrap());
    assert_eq!(owner_of(&keys, &next), Some(before.owner));
    // Reloading the file does not reset the counters.
    assert!(keys.caller_of(&one).unwrap().enter().is_err() && keys.caller_of(&next).unwrap().enter().is_ok());
    keys.replace_keys(&KeysFile::parse(&lines_of_two).unwrap());
    assert!(owner_of(&keys, &one).is_none() && owner_of(&keys, &two) == Some(Owner(1)));
    keys.replace_keys(&KeysFile::default());
    assert!(owner_of(&keys, &two).is_none() && !keys.is_open());
}

#[test]
fn as_many_requests_as_a_key_may_have_at_once() {
    let (key, lines) = generate("one").unwrap();
    let keys = keys(&["--api-keys", "other"]).unwrap();
    keys.replace_keys(&KeysFile::parse(&format!("{lines}concurrent_requests = 2\n")).unwrap());
    let caller = keys.caller_of(&key).unwrap();
    let (first, second) = (caller.enter(), caller.enter());
    assert_eq!(caller.enter().err().map(|too_many| too_many.limit), Some("2 requests at once".to_owned()));
    drop(first);
    assert!(caller.enter().is_ok() && second.is_ok());
}
