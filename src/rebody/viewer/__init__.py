"""The live page: a robot, its hidden task and what is believed of it, in a browser.

`Session` is what happens, and knows no page; `Page` shows it, and needs the extra `rebody[view]`.
"""
