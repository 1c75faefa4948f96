#include "viewer/scene/source_settings.h"

#include "viewer/scene/option_values.h"

namespace vcp {

SourceSettings::operator SourceAccess() const { return {caFile, cache, *parseBytes(cacheLimit), cancelled}; }

}  // namespace vcp
