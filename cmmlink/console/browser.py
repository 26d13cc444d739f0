"""The browser that shows the page, where this computer has one."""

import webbrowser

_TEXT_BROWSERS = ("www-browser", "links", "elinks", "lynx", "w3m")


def graphical_browser() -> webbrowser.BaseBrowser | None:
    """The browser of this computer, None where there is none with a window."""
    try:
        browser = webbrowser.get()
    except webbrowser.Error:
        return None
    return None if getattr(browser, "name", "") in _TEXT_BROWSERS else browser
