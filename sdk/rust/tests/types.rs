//! Types of the client.

/// The generated client, as the build script formats it.
const CLIENT: &str = include_str!(concat!(env!("OUT_DIR"), "/client.rs"));

#[test]
fn only_the_result_of_a_job_is_any_json() {
    let (before, rest) = CLIENT.split_once("\n    impl<'a> GetJobResult<'a> {").unwrap();
    let (of_job, after) = rest.split_once("\n    }\n").unwrap();
    // It is what the request of the job would have been answered with.
    assert!(of_job.contains("serde_json::"));
    for text in [before, after] {
        let any = text.lines().find(|line| line.contains("serde_json::"));
        assert_eq!(any, None, "a type is any JSON: the document should say more");
    }
}
