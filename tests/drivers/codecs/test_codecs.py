import pytest

from drivers.codecs import decoder, decoders
from drivers.codecs.ascii_frames import AsciiDecoder
from drivers.codecs.riftek_frames import RiftekDecoder


def test_every_format_is_found_by_its_name() -> None:
    assert set(decoders()) >= {"ascii", "binary", "optoncdt", "riftek", "riftek-ascii"}
    assert isinstance(decoder("ascii"), AsciiDecoder)
    assert isinstance(decoder("riftek", range_mm=50.0, rate_hz=1000.0), RiftekDecoder)


@pytest.mark.parametrize(
    ("name", "options", "complaint"),
    [
        ("morse", {}, "format 'morse' is none of ascii, binary"),
        ("riftek", {"range_mm": 50.0}, "format riftek: missing a required argument: 'rate_hz'; it takes range_mm, rate_hz"),
        ("ascii", {"speed": 1}, "format ascii: got an unexpected keyword argument 'speed'; it takes unit"),
        ("ascii", {"unit": "furlong"}, "unit 'furlong' is none of mm"),
        ("riftek", {"range_mm": "50 mm", "rate_hz": 1000}, "format riftek: range_mm is '50 mm'; it takes a number"),
        ("riftek", {"range_mm": True, "rate_hz": 1000}, "format riftek: range_mm is True; it takes a number"),
        ("riftek", {"range_mm": 50, "rate_hz": float("inf")}, "format riftek: rate_hz is inf; it takes a number"),
        ("optoncdt", {"range_mm": 50, "count": 8000.5}, "format optoncdt: count is 8000.5; it takes a whole number"),
        ("ascii", {"unit": 25.4}, "format ascii: unit is 25.4; it takes text"),
        ("riftek-ascii", {"rate_hz": 100, "request_line": 7}, "format riftek-ascii: request_line is 7; it takes text"),
        ("riftek", {"range_mm": -1.0, "rate_hz": 1.0}, "must be positive"),
    ],
)
def test_wrong_options_are_named(name: str, options: dict[str, object], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        decoder(name, **options)
