// Draws annotations into pictures, whole or rows of them.
#pragma once

#include <functional>
#include <vector>

#include "render/picture.h"
#include "viewer/annotation/annotations.h"

namespace vcp {

/// Paints annotations over rows of a picture, from `firstRow` on; `rows` is as wide as the picture. `isDark`: light
/// text on dark plates, else dark on light.
void paintAnnotations(const Annotations& annotations, const AnnotatedView& view, bool isDark, Picture& rows,
                      uint32_t firstRow = 0);

/// Returns what paints annotations over the rows of numbered pictures (PictureSequenceOptions::paintOver). `views`: one
/// for each picture.
std::function<void(size_t picture, Picture& rows, uint32_t firstRow)> annotationPainter(
    Annotations annotations, std::vector<AnnotatedView> views, bool isDark);

}  // namespace vcp
