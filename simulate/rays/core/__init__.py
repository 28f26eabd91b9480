"""What every mechanism of the ray tracer needs: the scene in Sionna RT, slabs, planes, reflections, electric field."""
