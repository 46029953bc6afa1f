"""A one-legged robot of one's own: an MJCF, and the TOML file beside it."""

import pytest

MJCF = """
<mujoco>
  <option timestep="0.01"/>
  <default><motor ctrllimited="true" ctrlrange="-1 1"/></default>
  <worldbody>
    <geom type="plane" size="9 9 1"/>
    <body name="trunk" pos="0 0 0.5">
      <freejoint/>
      <geom type="box" size="0.3 0.1 0.1"/>
      <body name="leg" pos="0.3 0 0">
        <joint name="hip" axis="0 1 0" damping="1"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.04"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="muscle" joint="hip"/></actuator>
</mujoco>
"""
TOML = """
mjcf = "own.xml"
frame_skip = 5

[root]
body = "trunk"

[fall]
max_pitch = 1.5

[reach]
velocity = [-1, 2.5]
"""


@pytest.fixture
def write_own(tmp_path):
    """A function: (replacements in the TOML, in the MJCF) -> path of the TOML."""

    def write(toml=(), mjcf=()):
        for name, text, replacements in (("own.toml", TOML, toml), ("own.xml", MJCF, mjcf)):
            for old, new in replacements:
                assert old in text
                text = text.replace(old, new)
            (tmp_path / name).write_text(text)
        return str(tmp_path / "own.toml")

    return write
