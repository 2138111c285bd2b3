!> Cairn for Fortran programs: a scene, a simulation, arrays in and out. The same calls as cairn/cairn.h, with sizes taken from
!> the arrays and texts as they are. Every call has a last optional argument, error; without it a wrong call stops the program
!> with its message.
module cairn
  use cairn_calls, only: cairn_error
  use cairn_scenes, only: cairn_scene, create_scene, destroy_scene, set_gravity, set_cell, add_material, add_material_of_group, &
    set_law, set_default_law, set_rule, plug_contact_law, add_bodies, set_body_field, drive_bodies, add_contactors, &
    add_polygons, add_polyhedra, add_round_hulls, add_hull_contactors, add_surface, add_joint
  use cairn_simulations
  use cairn_meshes
  use cairn_frames
  use cairn_solids
  use cairn_motions
  use cairn_controls
  use cairn_ranks
  use cairn_transforms
  use cairn_networks
  use cairn_fluids
  use cairn_problems
  use cairn_files
  implicit none
  public
end module cairn
