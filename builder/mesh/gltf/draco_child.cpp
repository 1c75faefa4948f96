#include "builder/mesh/gltf/draco_child.h"

#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <new>
#include <string>
#include <vector>

#include "builder/stream/colour_encoding.h"
#include "octree/surface/vertex_normal.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#include <draco/compression/decode.h>
#pragma GCC diagnostic pop

namespace vcp {
namespace {

constexpr size_t kBatch = 4096;

[[noreturn]] void leave() { ::_exit(0); }

// Writes to the pipe; a parent that no longer reads ends the child by a signal.
void send(int pipe, const void* data, size_t bytes) {
    const char* p = static_cast<const char*>(data);
    while (bytes > 0) {
        const ssize_t put = ::write(pipe, p, bytes);
        if (put < 0 && errno == EINTR) continue;
        if (put < 0) leave();
        p += put;
        bytes -= size_t(put);
    }
}

[[noreturn]] void refuse(int pipe, ErrorCode code, const std::string& message) {
    DracoReply reply;
    reply.failed = uint32_t(code) + 1;
    reply.messageBytes = uint32_t(message.size());
    send(pipe, &reply, sizeof reply);
    send(pipe, message.data(), message.size());
    leave();
}

const draco::PointAttribute* attribute(const draco::Mesh& mesh, std::optional<uint32_t> id, int components) {
    const draco::PointAttribute* const found = id ? mesh.GetAttributeByUniqueId(*id) : nullptr;
    return found && found->num_components() >= components ? found : nullptr;
}

Rgba8 colourOf(const draco::PointAttribute& colours, draco::AttributeValueIndex value, bool linear) {
    const auto components = int8_t(std::min<int>(colours.num_components(), 4));
    if (colours.data_type() == draco::DT_UINT8 && !linear) {
        std::array<uint8_t, 4> bytes{0, 0, 0, 255};
        colours.ConvertValue<uint8_t>(value, components, bytes.data());
        if (components < 4) bytes[3] = 255;
        return packRgba(bytes);
    }
    std::array<float, 4> reals{0, 0, 0, 1};
    colours.ConvertValue<float>(value, components, reals.data());
    float scale = 1;
    if (!colours.normalized() && colours.data_type() == draco::DT_UINT8) scale = 1 / 255.0f;
    if (!colours.normalized() && colours.data_type() == draco::DT_UINT16) scale = 1 / 65535.0f;
    for (float& real : reals) real *= scale;
    if (components < 4) reals[3] = 1;
    if (linear) return encodeRgba({reals[0], reals[1], reals[2], reals[3]});
    return packRgba({toByte(reals[0]), toByte(reals[1]), toByte(reals[2]), toByte(reals[3])});
}

uint32_t normalOf(const draco::PointAttribute& normals, draco::AttributeValueIndex value) {
    std::array<float, 3> n{};
    if (!normals.ConvertValue<float>(value, 3, n.data())) return kUnknownNormal;
    return packDirection({n[0], n[1], n[2]});
}

void sendVertices(const draco::Mesh& mesh, const draco::PointAttribute& positions, const draco::PointAttribute* colours,
                  const draco::PointAttribute* normals, bool linear, int pipe) {
    std::vector<DracoVertex> batch;
    batch.reserve(kBatch);
    for (uint32_t i = 0; i < mesh.num_points(); ++i) {
        const draco::PointIndex point(i);
        DracoVertex vertex{};
        positions.ConvertValue<double>(positions.mapped_index(point), 3, vertex.position);
        if (colours) vertex.colour = colourOf(*colours, colours->mapped_index(point), linear);
        if (normals) vertex.normal = normalOf(*normals, normals->mapped_index(point));
        batch.push_back(vertex);
        if (batch.size() == kBatch || i + 1 == mesh.num_points()) {
            send(pipe, batch.data(), batch.size() * sizeof(DracoVertex));
            batch.clear();
        }
    }
}

void sendFaces(const draco::Mesh& mesh, const draco::PointAttribute* uvs, int pipe) {
    std::vector<DracoFace> batch;
    batch.reserve(kBatch);
    for (uint32_t i = 0; i < mesh.num_faces(); ++i) {
        const draco::Mesh::Face& face = mesh.face(draco::FaceIndex(i));
        DracoFace sent{};
        for (size_t corner = 0; corner < 3; ++corner) {
            sent.vertex[corner] = face[corner].value();
            if (uvs && face[corner].value() < mesh.num_points())
                uvs->ConvertValue<float>(uvs->mapped_index(face[corner]), 2, sent.uv[corner]);
        }
        batch.push_back(sent);
        if (batch.size() == kBatch || i + 1 == mesh.num_faces()) {
            send(pipe, batch.data(), batch.size() * sizeof(DracoFace));
            batch.clear();
        }
    }
}

void decode(const DracoBytes& bytes, const DracoSelection& selection, int pipe) {
    auto compressed = bytes();
    if (!compressed) refuse(pipe, compressed.error().code, compressed.error().message);
    draco::DecoderBuffer buffer;
    buffer.Init(compressed->data(), compressed->size());
    const auto type = draco::Decoder::GetEncodedGeometryType(&buffer);
    if (!type.ok())
        refuse(pipe, ErrorCode::InvalidInput, std::string("is not Draco data (") + type.status().error_msg() + ")");
    if (type.value() != draco::TRIANGULAR_MESH)
        refuse(pipe, ErrorCode::InvalidInput, "has no faces, only points; reconstruct a surface first");
    draco::Decoder decoder;
    auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
    if (!decoded.ok())
        refuse(pipe, ErrorCode::InvalidInput,
               std::string("the Draco data are damaged (") + decoded.status().error_msg() + ")");
    const draco::Mesh& mesh = *decoded.value();

    const auto* positions = selection.byIdentifier ? attribute(mesh, selection.position, 3)
                                                   : mesh.GetNamedAttribute(draco::GeometryAttribute::POSITION);
    const auto* colours = selection.byIdentifier ? attribute(mesh, selection.colour, 3)
                                                 : mesh.GetNamedAttribute(draco::GeometryAttribute::COLOR);
    const auto* normals = selection.byIdentifier ? attribute(mesh, selection.normal, 3)
                                                 : mesh.GetNamedAttribute(draco::GeometryAttribute::NORMAL);
    const auto* const uvs = attribute(mesh, selection.uv, 2);
    if (!positions || positions->num_components() != 3)
        refuse(pipe, ErrorCode::InvalidInput, "has no positions of 3 components");
    if (colours && colours->num_components() < 3) colours = nullptr;
    if (normals && normals->num_components() != 3) normals = nullptr;
    if (mesh.num_faces() == 0)
        refuse(pipe, ErrorCode::InvalidInput, "has no faces, only points; reconstruct a surface first");

    DracoReply reply;
    reply.vertices = mesh.num_points();
    reply.faces = mesh.num_faces();
    reply.hasColour = colours != nullptr;
    reply.hasUv = uvs != nullptr;
    reply.hasNormals = normals != nullptr;
    send(pipe, &reply, sizeof reply);
    sendVertices(mesh, *positions, colours, normals, selection.linearColour, pipe);
    sendFaces(mesh, uvs, pipe);
}

}  // namespace

void runDracoChild(const DracoBytes& bytes, const DracoSelection& selection, int pipe) {
    try {
        decode(bytes, selection, pipe);
    } catch (const std::bad_alloc&) {
        refuse(pipe, ErrorCode::Limit, "needs more memory to decode than it may have");
    } catch (...) {
        refuse(pipe, ErrorCode::InvalidInput, "the Draco decoder failed");
    }
    leave();
}

}  // namespace vcp
