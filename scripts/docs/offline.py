"""A page that would fetch anything from elsewhere does not get built: readers may have no network."""

import re

from mkdocs.exceptions import PluginError

FETCHED = re.compile(r'<(?:(?:script|img|iframe|source|video)\b[^>]*\bsrc|link\b[^>]*\bhref)="(?:https?:)?//[^"]*')


def on_post_page(output, page, **_):
    """Hook of MkDocs: look through the finished page."""
    if fetched := FETCHED.search(output):
        raise PluginError(f"{page.file.src_uri} fetches from the network: {fetched[0]}")
    return output
