# cmake -D INPUT=x.spv -D OUTPUT=x_spirv.h -D NAME=x -P embed_spirv.cmake: SPIR-V as an array of words.
file(READ ${INPUT} bytes HEX)
string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," words "${bytes}")
string(REGEX REPLACE "((0x........,)(0x........,)(0x........,)(0x........,)(0x........,)(0x........,)(0x........,)(0x........,))" "\\1\n" words "${words}")
string(SUBSTRING ${NAME} 0 1 initial)
string(TOUPPER ${initial} initial)
string(SUBSTRING ${NAME} 1 -1 rest)
file(WRITE ${OUTPUT} "#pragma once\n\n#include <cstdint>\n\nnamespace vcp {\n\ninline constexpr uint32_t k${initial}${rest}Spirv[] = {\n${words}\n};\n\n}  // namespace vcp\n")
