// The marchers of mesostructure/shared/, one a pipeline by the constants of meso_bindings.glsl.
#include "mesostructure/shared/cell_solve.h"
#include "mesostructure/shared/cone_lookup.h"
#include "mesostructure/shared/grid_walk.h"
#include "mesostructure/shared/patch_solve.h"
#include "mesostructure/shared/march_data.h"
#include "mesostructure/shared/march_cells.h"
#include "mesostructure/shared/march_gdm.h"
#include "mesostructure/shared/march.h"
