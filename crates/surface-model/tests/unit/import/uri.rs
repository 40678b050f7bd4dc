use super::*;

#[test]
fn base64_gives_the_examples_of_rfc_4648() {
    for (text, plain) in
        [("", ""), ("Zg==", "f"), ("Zm8=", "fo"), ("Zm9v", "foo"), ("Zm9vYg", "foob"), ("Zm9vYmFy", "foobar")]
    {
        assert_eq!(base64(text.as_bytes()).unwrap(), plain.as_bytes());
    }
    assert_eq!(base64(b"-_+/").unwrap(), [0xfb, 0xff, 0xbf]);
    assert!(base64(b"Zm9vY").is_err() && base64(b"Zm9 v").is_err());
}

#[test]
fn addresses_are_distinguished() {
    assert!(embedded("a%20b.bin").is_none() && embedded("dätä:").is_none());
    assert!(embedded("data:text/plain,abc").unwrap().is_err());
    assert_eq!(embedded("data:application/octet-stream;base64,AAEC").unwrap().unwrap(), [0, 1, 2]);
    assert_eq!(percent_decoded("a%20b%2.bin%C3%A4%"), "a b%2.binä%");
}
