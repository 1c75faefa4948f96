// The window's icons, by what they stand for: characters of icons.ttf, which make_fonts.py makes from this list.
#pragma once

namespace vcp::icon {

inline constexpr const char* kOpen = "\xef\x89\x96";          // U+F256 folder-outline
inline constexpr const char* kFolder = "\xef\x89\x8b";        // U+F24B folder
inline constexpr const char* kFile = "\xef\x86\xa7";          // U+F1A7 cube-outline
inline constexpr const char* kView = "\xef\x86\xa7";          // U+F1A7 cube-outline
inline constexpr const char* kLight = "\xef\x96\xa8";         // U+F5A8 white-balance-sunny
inline constexpr const char* kCut = "\xef\x86\x90";           // U+F190 content-cut
inline constexpr const char* kMeasure = "\xef\x91\xad";       // U+F46D ruler
inline constexpr const char* kAnnotate = "\xef\x8d\x8e";      // U+F34E map-marker
inline constexpr const char* kCompare = "\xef\x93\xa2";       // U+F4E2 swap-vertical
inline constexpr const char* kEdit = "\xef\x8f\xab";          // U+F3EB pencil
inline constexpr const char* kLayers = "\xef\x8c\xa8";        // U+F328 layers
inline constexpr const char* kDetails = "\xef\x8b\xbd";       // U+F2FD information-outline
inline constexpr const char* kFit = "\xef\x86\x9f";           // U+F19F crop-free
inline constexpr const char* kHome = "\xef\x8b\x9c";          // U+F2DC home
inline constexpr const char* kFly = "\xef\x80\x9d";           // U+F01D airplane
inline constexpr const char* kShading = "\xef\x8f\x98";       // U+F3D8 palette
inline constexpr const char* kShadows = "\xef\x86\x97";       // U+F197 contrast-circle
inline constexpr const char* kOcclusion = "\xef\x82\xb8";     // U+F0B8 blur-radial
inline constexpr const char* kPicture = "\xef\x84\x80";       // U+F100 camera
inline constexpr const char* kTurntable = "\xef\x91\xa4";     // U+F464 rotate-3d
inline constexpr const char* kPath = "\xef\x95\xa7";          // U+F567 video
inline constexpr const char* kHelp = "\xef\x98\xa5";          // U+F625 help-circle-outline
inline constexpr const char* kPanel = "\xef\x98\xae";         // U+F62E tune
inline constexpr const char* kMore = "\xef\x87\x98";          // U+F1D8 dots-horizontal
inline constexpr const char* kClose = "\xef\x85\x96";         // U+F156 close
inline constexpr const char* kSearch = "\xef\x8d\x89";        // U+F349 magnify
inline constexpr const char* kChevronRight = "\xef\x85\x82";  // U+F142 chevron-right
inline constexpr const char* kChevronDown = "\xef\x85\x80";   // U+F140 chevron-down
inline constexpr const char* kProblem = "\xef\x97\x96";       // U+F5D6 alert-circle-outline
inline constexpr const char* kCopy = "\xef\x86\x8f";          // U+F18F content-copy
inline constexpr const char* kPaste = "\xef\x86\x92";         // U+F192 content-paste
inline constexpr const char* kAdd = "\xef\x90\x95";           // U+F415 plus
inline constexpr const char* kRemove = "\xef\x8d\xb4";        // U+F374 minus
inline constexpr const char* kDelete = "\xef\x87\x80";        // U+F1C0 delete
inline constexpr const char* kDemo = "\xef\x90\x8d";          // U+F40D play-circle-outline
inline constexpr const char* kUp = "\xef\x81\x9d";            // U+F05D arrow-up
inline constexpr const char* kFlip = "\xef\x93\xa2";          // U+F4E2 swap-vertical
inline constexpr const char* kExport = "\xef\x88\x87";        // U+F207 export

}  // namespace vcp::icon
