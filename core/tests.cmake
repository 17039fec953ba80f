# The tests that stand beside their sources: one program a folder.
fstop_test(core_test LABEL unit SOURCES units_test.cpp fast_math_test.cpp geometry_test.cpp LINK fstop_core)

fstop_test(parallel_test LABEL unit threads SOURCES parallel_test.cpp LINK fstop_core)

fstop_test(optics_test LABEL unit
           SOURCES optics/aperture_test.cpp optics/depth_of_field_test.cpp
                   optics/exposure_test.cpp optics/pinhole_test.cpp optics/thin_lens_test.cpp
           LINK fstop_optics fstop_oracle)

fstop_test(diffraction_test LABEL unit
           SOURCES optics/astigmatic_otf_test.cpp optics/bessel_test.cpp
                   optics/circular_psf_test.cpp optics/defocus_field_test.cpp
                   optics/diffraction_test.cpp optics/encircled_energy_test.cpp
                   optics/lommel_test.cpp optics/oblique_pinhole_test.cpp
                   optics/pinhole_figures_test.cpp
                   optics/polygon_otf_test.cpp optics/polygon_psf_test.cpp
                   optics/quadrature_test.cpp optics/rayleigh_sommerfeld_test.cpp
                   optics/spectrum_test.cpp optics/transfer_test.cpp
           LINK fstop_optics fstop_oracle)

fstop_test(sampling_test LABEL unit SOURCES sampling/lane_sequence_test.cpp
           sampling/patterns_test.cpp
           sampling/sequence_test.cpp sampling/stream_test.cpp
           sampling/warp_test.cpp
           LINK fstop_sampling fstop_oracle)

fstop_test(camera_test LABEL unit
           SOURCES camera/aim_frame_test.cpp camera/camera_spec_test.cpp
                   camera/film_projection_test.cpp camera/optical_summary_test.cpp
                   camera/pinhole_camera_test.cpp camera/thin_lens_camera_test.cpp
           LINK fstop_camera)

fstop_test(film_test LABEL unit SOURCES film/film_test.cpp film/replicate_film_test.cpp
           LINK fstop_film fstop_oracle)

fstop_test(scene_test LABEL unit
           SOURCES scene/emitters_test.cpp scene/lane_surfaces_test.cpp scene/mapping_test.cpp
                   scene/ray_scene_test.cpp
                   scene/texture_filters_test.cpp scene/texture_test.cpp
                   scene/vertex_normals_test.cpp
           LINK fstop_scene)

fstop_test(block_test LABEL unit
           SOURCES render/allocation_test.cpp render/block_tracer_test.cpp
                   render/defocus_filter_test.cpp
           LINK fstop_render)

fstop_test(measure_test LABEL unit
           SOURCES measure/disc_edge_test.cpp measure/image_difference_test.cpp measure/profile_scale_test.cpp
                   measure/sharpness_test.cpp measure/slanted_edge_test.cpp
                   measure/spline_fit_test.cpp measure/spot_test.cpp measure/star_contrast_test.cpp
           LINK fstop_measure fstop_optics fstop_oracle)

fstop_test(finishing_test LABEL unit SOURCES post/composite_test.cpp post/halftone_test.cpp
                   post/layer_stack_test.cpp
           LINK fstop_post)

fstop_test(point_spread_test LABEL unit
           SOURCES post/point_spread_image_test.cpp post/point_spread_test.cpp
           LINK fstop_post fstop_oracle)

fstop_test(spectral_test LABEL unit
           SOURCES post/far_halo_test.cpp post/spectral_plane_test.cpp
                   post/wave_transfer_test.cpp
           LINK fstop_post)

fstop_test(study_test LABEL unit
           SOURCES study/accuracy_chart_test.cpp study/chart_svg_test.cpp
                   study/pinhole_theory_test.cpp study/sweep_range_test.cpp
                   study/expected_optics_test.cpp
                   study/image_baseline_test.cpp study/verification_test.cpp
           LINK fstop_study)
