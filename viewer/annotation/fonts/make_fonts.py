#!/usr/bin/python3
"""Makes the fonts of window and pictures: subsets of Inter and of Material Design Icons, as Debian 12 packs them.

    apt-get install fonts-inter fonts-materialdesignicons-webfont python3-fonttools
    ./make_fonts.py

Writes inter_regular.otf, inter_semibold.otf and icons.ttf beside itself, the same bytes each time. Inter keeps Latin,
Greek and Cyrillic letters, digits and the signs that the window's texts use. Dear ImGui knows no OpenType features: so that columns of
numbers stand still, digits and the signs around them become their tabular forms here. viewer/window/icons.h lists
the icons; a test compares the two.
"""

import pathlib
import re

from fontTools import subset
from fontTools.ttLib import TTFont

HERE = pathlib.Path(__file__).resolve().parent
INTER = pathlib.Path("/usr/share/fonts/opentype/inter")
ICONS = pathlib.Path("/usr/share/fonts/truetype/materialdesignicons-webfont/materialdesignicons-webfont.ttf")

# Latin with its accents; dashes, quotes, dots, thin spaces and raised figures; signs of units and keys; Greek and
# Cyrillic.
TEXT = [*range(0x20, 0x7F), *range(0xA0, 0x180), *range(0x2009, 0x200B), 0x202F, *range(0x2010, 0x2016),
        *range(0x2018, 0x201F), 0x2022, 0x2026, 0x2032, 0x2033, 0x2070, *range(0x2074, 0x207A), 0x207B,
        *range(0x2190, 0x2194), 0x2212, 0x2248, 0x2264, 0x2265, 0x21E7, *range(0x0370, 0x0530)]


def tabular(font):
    """Lets each character whose glyph has a tabular form stand for that."""
    forms = {}
    table = font["GSUB"].table
    for feature in table.FeatureList.FeatureRecord:
        if feature.FeatureTag != "tnum":
            continue
        for lookup in feature.Feature.LookupListIndex:
            for each in table.LookupList.Lookup[lookup].SubTable:
                forms.update(getattr(each, "ExtSubTable", each).mapping)
    for each in font["cmap"].tables:
        for code, glyph in each.cmap.items():
            # A plain space keeps its width: words are set with it.
            if code != 0x20 and glyph in forms:
                each.cmap[code] = forms[glyph]


def write(source, name, codes, makes_tabular):
    font = TTFont(source, recalcTimestamp=False)
    if makes_tabular:
        tabular(font)
    options = subset.Options(layout_features=[], hinting=False, notdef_outline=True, name_IDs=[0, 13, 14],
                             desubroutinize=True, recalc_timestamp=False, drop_tables=["GPOS", "GSUB", "GDEF", "DSIG"])
    chosen = subset.Subsetter(options)
    chosen.populate(unicodes=codes)
    chosen.subset(font)
    font.save(HERE / name)
    print(name, (HERE / name).stat().st_size, "bytes,", len(font.getBestCmap()), "characters")


icons = [int(code, 16) for code in re.findall(r"U\+(F[0-9A-F]{3})", (HERE.parents[1] / "window" / "icons.h").read_text())]
write(INTER / "Inter-Regular.otf", "inter_regular.otf", TEXT, True)
write(INTER / "Inter-SemiBold.otf", "inter_semibold.otf", TEXT, True)
write(ICONS, "icons.ttf", icons, False)
